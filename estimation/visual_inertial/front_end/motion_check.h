#pragma once
// Removes tracks that do not move like a static world, by the epipolar constraint over several
// spans of images: drifting marine snow becomes detectable in a second, not in one image. Internal.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/camera_model.h"
#include "common/random.h"
#include "estimation/visual_inertial/front_end/gyro_turn.h"
#include "estimation/visual_inertial/front_end/track.h"

namespace dive::estimation {

class MotionCheck {
 public:
  /// Tolerances in pixels: since the last image, and over the longer spans. What the gyro's bias
  /// may add is on top of them.
  struct Tolerances {
    double last = 0.0;
    double drift = 0.0;
  };

  MotionCheck(const CameraModel& camera, Tolerances tolerances, std::uint64_t seed);

  /// Forgets the rotations, when all tracks are dropped.
  void reset();
  /// Removes the tracks that disagree since the last image, since the one Track::kPast before, and
  /// half way; returns their number. `image`: number of the present image; `turn`: of the
  /// left camera since the last one.
  [[nodiscard]] int remove_moving(std::vector<Track>& tracks, std::size_t image,
                                  const CameraTurn& turn);

 private:
  [[nodiscard]] int remove_over(std::vector<Track>& tracks, std::size_t image, std::size_t span,
                                const CameraTurn& turn, double tolerance);

  CameraModel camera_;
  Tolerances tolerances_;
  Random random_;
  /// Turn of the left camera since each image, by image number modulo Track::kPast.
  std::array<CameraTurn, Track::kPast> turned_since_;
};

}  // namespace dive::estimation
