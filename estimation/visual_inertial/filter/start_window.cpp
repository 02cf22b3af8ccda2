#include "estimation/visual_inertial/filter/start_window.h"

namespace dive::estimation {

ImuStep propagate_over(const ImuState& begin, const std::vector<ImuInterval>& imu,
                       const ImuNoise& noise, double gravity) {
  ImuStep sum{begin, Matrix15d::Identity(), Matrix15d::Zero()};
  for (const ImuInterval& interval : imu) {
    const ImuStep step = propagate(sum.state, sum.state.motion, interval, noise, gravity);
    sum.transition = step.transition * sum.transition;
    sum.noise = step.transition * sum.noise * step.transition.transpose() + step.noise;
    sum.state = step.state;
  }
  return sum;
}

}  // namespace dive::estimation
