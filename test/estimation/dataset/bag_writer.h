#pragma once
// Writes small ROS 1 bags and MCAP files, from the formats' published descriptions only.

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/measurements.h"
#include "common/se3.h"

namespace dive::estimation::testing {

enum class Wire { kRos1, kCdr, kBigCdr };

/// Fields of a message, in order.
class MessageWriter {
 public:
  explicit MessageWriter(Wire wire);
  template <typename Number>
  MessageWriter& number(Number value) {
    return raw(reinterpret_cast<const char*>(&value), sizeof value);
  }
  MessageWriter& text(const std::string& text);
  MessageWriter& array(const std::string& bytes);
  MessageWriter& header(std::uint64_t ns);
  MessageWriter& vector(const Eigen::Vector3d& v);
  MessageWriter& quaternion(const Eigen::Quaterniond& q);
  MessageWriter& zeros(int count);
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  MessageWriter& raw(const char* value, std::size_t size);

  Wire wire_;
  std::string bytes_;
};

struct Written {
  std::string topic;
  std::string type;  ///< As in ROS 1.
  std::uint64_t ns = 0;
  std::string bytes;
};

[[nodiscard]] Written imu_message(Wire wire, const std::string& topic, std::uint64_t ns,
                                  const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel);
/// A geometry_msgs/TwistStamped.
[[nodiscard]] Written velocity_message(Wire wire, const std::string& topic, std::uint64_t ns,
                                       const Eigen::Vector3d& v);
[[nodiscard]] Written pressure_message(Wire wire, const std::string& topic, std::uint64_t ns,
                                       double pressure);
[[nodiscard]] Written pose_message(Wire wire, const std::string& topic, std::uint64_t ns,
                                   const Pose& X);
/// `data`: rows of `step` bytes.
[[nodiscard]] Written image_message(Wire wire, const std::string& topic, std::uint64_t ns,
                                    const std::string& encoding, int width, int height, int step,
                                    const std::string& data);
[[nodiscard]] Written gray_message(Wire wire, const std::string& topic, std::uint64_t ns,
                                   const ImageFrame& image);
[[nodiscard]] Written compressed_message(Wire wire, const std::string& topic, std::uint64_t ns,
                                         const std::string& data);

/// `compression`: none, bz2, lz4. Chunks of `per_chunk` messages.
[[nodiscard]] std::string ros1_bag(const std::vector<Written>& messages,
                                   const std::string& compression, std::size_t per_chunk);
/// `compression`: "", lz4, zstd; "no chunks" for none. `encoding`: cdr or ros1.
[[nodiscard]] std::string mcap(const std::vector<Written>& messages, const std::string& compression,
                               std::size_t per_chunk, const std::string& encoding = "cdr");

/// A bag of ROS 2 in sqlite3 as a new file.
void write_sqlite_bag(const std::string& path, const std::vector<Written>& messages);

}  // namespace dive::estimation::testing
