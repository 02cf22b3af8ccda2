#pragma once
// retrace: back along the breadcrumb trail to the last point with open water above. The way was
// swum once, so it is known to be free; nothing is planned. Done at once where nothing is overhead.

#include <optional>

#include "behaviors/behavior.h"
#include "behaviors/trail.h"
#include "vehicle/follower.h"

namespace dive::behaviors {

class Retrace final : public Behavior {
 public:
  /// The way out is taken from the trail as it is now; `open_above` says that there is open water
  /// above `p_W`, so that there is nothing to retrace.
  Retrace(const Trail& trail, const Eigen::Vector3d& p_W, bool open_above, double speed);

  /// `failed` when the trail never saw open water, or the vehicle does not get on along it (slower
  /// than a quarter of the speed on average, after a minute's grace).
  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return progress_; }

 private:
  vehicle::Follower follower_;
  bool open_above_ = false;
  bool reaches_open_water_ = false;
  double time_allowed_s_ = 0.0;
  std::optional<Utime> entered_at_;
  Progress progress_;
};

}  // namespace dive::behaviors
