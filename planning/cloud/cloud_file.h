#pragma once
// Point clouds in files: PCD and PLY in, PLY out.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/se3.h"

namespace dive::planning {

/// A cloud as stored in its file, in metres, in the axes of the file: the caller must establish
/// whether z is up. A point of the file lies at origin + points[i].
struct CloudFile {
  /// Finite, distinct points in the order of the file.
  std::vector<Eigen::Vector3f> points;
  /// Offset of the points in whole metres. Zero on an axis where the median of the points is within
  /// 1000 m of zero, else that median: 4-byte floats would round a UTM coordinate to decimetres.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double unit_m = 1.0;  ///< Metres per unit of the file, as requested or guessed.
  /// Number of points that are not finite, or farther than 10^8 m from zero.
  std::size_t dropped = 0;
  /// Number of points left out because another has the same coordinates.
  std::size_t duplicates = 0;
  /// Pose of the sensor in the axes of the file, m, without subtracting `origin`. Source: PCD's
  /// VIEWPOINT, where most writers put the identity if the pose is unknown.
  std::optional<Pose> viewpoint;
  std::vector<std::string> warnings;  ///< Messages for people; a guessed unit always gives one.
};

struct CloudOptions {
  /// Metres per unit of the file. Absent: millimetres if the file looks like a depth camera's, else
  /// metres. It does if it has ten points or more, no coordinate beyond 65535 (16 bits of depth),
  /// an extent above 500 in the cloud and above 100 in z, and whole numbers for 99 of 100 z.
  std::optional<double> unit_m;
  std::size_t max_points = 10'000'000;  ///< Limit of points in the file, before any is dropped.
};

/// True if `head`, the first bytes of a file, begin a cloud that read_cloud() reads.
[[nodiscard]] bool begins_like_cloud(std::string_view head);

/// Reads PCD .5 to .7 (ascii, binary, binary_compressed; fields in any order and of any type) and
/// PLY 1.0 (ascii, binary of either byte order; vertices only), recognised by content, not by name.
/// Memory is bounded by the file size and by `max_points`, not by the header. The error gives the
/// cause, with the line number in text, or what else the file seems to be; it does not name the
/// file.
[[nodiscard]] tl::expected<CloudFile, std::string> read_cloud(const std::string& path,
                                                              const CloudOptions& options);

/// Points as binary little-endian PLY (float x y z); each comment becomes one line of its header.
[[nodiscard]] std::string to_ply(const std::vector<Eigen::Vector3f>& points,
                                 const std::vector<std::string>& comments);

}  // namespace dive::planning
