#pragma once
// Points with descriptors, and their views by a stereo pair: places without images.

#include <cstdint>
#include <vector>

#include "common/camera_model.h"
#include "common/random.h"
#include "estimation/visual_inertial/loop_closure/keyframe.h"

namespace dive::testing {

class MarkedWorld {
 public:
  /// A camera pair of 752 x 480 pixels, f = 240, 0.14 m apart, facing along x of B.
  [[nodiscard]] static CameraModel camera(int index);

  /// Adds `count` points within the box, each with a descriptor of its own.
  void add(int count, const Eigen::Vector3d& low, const Eigen::Vector3d& high, Random& random);
  /// Copies the points and descriptors to another place.
  void repeat(const Eigen::Vector3d& shift);

  /// The view from X_WB within 8 m, with noise of `pixels`; a few bits of each descriptor are
  /// wrong. At most 160 points.
  [[nodiscard]] estimation::KeyframeView view(Utime utime, const Pose& X_WB, Random& random,
                                              double pixels = 0.7) const;

 private:
  struct Mark {
    Eigen::Vector3d p_W;
    estimation::Descriptor descriptor;
  };
  std::vector<Mark> marks_;
};

}  // namespace dive::testing
