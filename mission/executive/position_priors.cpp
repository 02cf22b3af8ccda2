#include "mission/executive/position_priors.h"

#include <cmath>

namespace dive::mission {

estimation::MapFixOptions map_fix_options(const Mission& mission, const MotionModel& motion) {
  estimation::MapFixOptions fixes;
  fixes.slip_sigma = motion.slip_sigma.maxCoeff();
  fixes.slip_time_s = motion.slip_time_s;
  const Priors& priors = mission.priors;
  fixes.start_sigma_m = std::hypot(priors.start_m, priors.map_m);
  fixes.heading_sigma_deg = std::hypot(fixes.heading_sigma_deg, priors.map_deg);
  fixes.current_sigma = priors.current;
  return fixes;
}

estimation::PrimitiveOptions odometry_options(const Mission& mission,
                                              estimation::PrimitiveOptions options) {
  options.current_sigma = mission.priors.current;
  return options;
}

}  // namespace dive::mission
