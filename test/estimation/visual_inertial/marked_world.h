#pragma once
// Points with descriptors, and what a stereo pair sees of them: places without pictures.

#include <cstdint>
#include <vector>

#include "common/camera_model.h"
#include "common/random.h"
#include "estimation/visual_inertial/keyframe.h"

namespace dive::testing {

class MarkedWorld {
 public:
  /// A camera pair of 752 x 480 pixels, f = 240, 0.14 m apart, that looks along x of B.
  [[nodiscard]] static CameraModel camera(int index);

  /// So many points within the box, each with a descriptor of its own.
  void add(int count, const Eigen::Vector3d& low, const Eigen::Vector3d& high, Random& random);
  /// The same points and descriptors again, elsewhere.
  void repeat(const Eigen::Vector3d& shift);

  /// What is seen from X_WB within 8 m, with noise of `pixels`; of each descriptor a few bits are
  /// wrong. At most 160 points.
  [[nodiscard]] estimation::PlaceView view(Utime utime, const Pose& X_WB, Random& random,
                                           double pixels = 0.7) const;

 private:
  struct Mark {
    Eigen::Vector3d p_W;
    estimation::Descriptor descriptor;
  };
  std::vector<Mark> marks_;
};

}  // namespace dive::testing
