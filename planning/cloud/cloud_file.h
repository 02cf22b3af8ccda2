#pragma once
// Point clouds in files: PCD and PLY in, PLY out.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/se3.h"

namespace dive::planning {

/// A cloud as its file has it, in metres, in the axes of the file: whether z is up is for the
/// caller to know. A point of the file lies at origin + points[i].
struct CloudFile {
  /// Finite, no two the same, in the order of the file.
  std::vector<Eigen::Vector3f> points;
  /// m, whole numbers. Zero on an axis where the median of the points is within 1000 m of zero,
  /// else that median: 4-byte floats would round a coordinate in UTM to decimetres.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double unit_m = 1.0;         ///< Metres per unit of the file: as asked for, or guessed.
  std::size_t dropped = 0;     ///< Points not finite, or farther than 10^8 m from zero.
  std::size_t duplicates = 0;  ///< Points left out because another has the same coordinates.
  /// Pose of the sensor in the axes of the file, m, `origin` not taken off. From PCD's VIEWPOINT:
  /// most writers put the identity there when they do not know.
  std::optional<Pose> viewpoint;
  std::vector<std::string> warnings;  ///< For people; a guessed unit is always one of them.
};

struct CloudOptions {
  /// Metres per unit of the file. Nothing: millimetres where the file looks as depth cameras write
  /// it, else metres. It does when there are ten points or more, no coordinate is beyond 65535 (16
  /// bits of depth), the cloud is more than 500 across and z more than 100, and 99 of 100 z are
  /// whole numbers.
  std::optional<double> unit_m;
  std::size_t max_points = 10'000'000;  ///< Of the file, before anything is dropped.
};

/// Reads PCD .5 to .7 (ascii, binary, binary_compressed; fields in any order and of any type) and
/// PLY 1.0 (ascii, binary of either byte order; vertices only), known by content and not by name.
/// Memory is bounded by the size of the file and by `max_points`, not by what its header promises.
/// An error says what is wrong, with the line where it is in text, or what else the file seems to
/// be; it does not name the file.
[[nodiscard]] tl::expected<CloudFile, std::string> read_cloud(const std::string& path,
                                                              const CloudOptions& options);

/// Writes points as binary little-endian PLY (float x y z); each comment becomes one line of its
/// header. False, and nothing at `path` changed, when it could not be written.
[[nodiscard]] bool write_ply(const std::string& path, const std::vector<Eigen::Vector3f>& points,
                             const std::vector<std::string>& comments);

}  // namespace dive::planning
