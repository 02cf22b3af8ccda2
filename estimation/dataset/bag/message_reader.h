#pragma once
// The fields of a serialised message, in order.

#include <algorithm>
#include <cstdint>
#include <string_view>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/clock.h"
#include "estimation/dataset/bag/bag_file.h"
#include "estimation/dataset/bag/byte_reader.h"

namespace dive::estimation {

/// ROS 1: little-endian, packed. CDR (XCDR version 1): after four bytes with the byte order,
/// numbers aligned to their size. As with ByteReader, one question whether all was there is enough.
class MessageReader {
 public:
  MessageReader(Bytes bytes, Serialization kind) : reader_(bytes), kind_(kind) {
    if (kind_ != Serialization::kCdr) return;
    const Bytes head = reader_.take_bytes(4);
    is_known_ = head.size() == 4 && head[0] == 0 && head[1] <= 1;
    is_big_ = is_known_ && head[1] == 0;
  }

  [[nodiscard]] bool ok() const {
    return reader_.ok() && is_known_ && kind_ != Serialization::kOther;
  }

  template <typename Number>
  [[nodiscard]] Number take() {
    align(sizeof(Number));
    auto value = reader_.take<Number>();
    if (is_big_) {
      auto* const bytes = reinterpret_cast<std::uint8_t*>(&value);
      std::reverse(bytes, bytes + sizeof value);
    }
    return value;
  }

  [[nodiscard]] Eigen::Vector3d take_vector() {
    Eigen::Vector3d v;
    for (double& value : v) value = take<double>();
    return v;
  }

  /// Stored x y z w.
  [[nodiscard]] Eigen::Quaterniond take_quaternion() {
    Eigen::Quaterniond q;
    for (double& value : q.coeffs()) value = take<double>();
    return q;
  }

  void skip_numbers(int count) {
    for (int i = 0; i < count; ++i) static_cast<void>(take<double>());
  }

  /// Valid as long as the message.
  [[nodiscard]] std::string_view take_text() {
    const auto length = take<std::uint32_t>();
    const Bytes bytes = reader_.take_bytes(length);
    std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (kind_ == Serialization::kCdr && !text.empty() && text.back() == '\0') {
      text.remove_suffix(1);
    }
    return text;
  }

  [[nodiscard]] Bytes take_array() {
    const auto length = take<std::uint32_t>();
    return reader_.take_bytes(length);
  }

  /// Reads a std_msgs/Header. Negative if the stamp is none.
  [[nodiscard]] Utime take_header() {
    if (kind_ == Serialization::kRos1) static_cast<void>(take<std::uint32_t>());  // sequence
    const auto seconds = take<std::uint32_t>();
    const auto nanoseconds = take<std::uint32_t>();
    static_cast<void>(take_text());  // frame
    if (nanoseconds >= 1'000'000'000U) return -1;
    return Utime{seconds} * kMicrosecondsPerSecond + (nanoseconds + 500) / 1000;
  }

 private:
  void align(std::size_t size) {
    if (kind_ != Serialization::kCdr) return;
    constexpr std::size_t kHead = 4;
    const std::size_t past = (reader_.position() - kHead) % size;
    if (past != 0) static_cast<void>(reader_.take_bytes(size - past));
  }

  ByteReader reader_;
  Serialization kind_;
  bool is_known_ = true;
  bool is_big_ = false;
};

}  // namespace dive::estimation
