#pragma once
// Certifies the exit path's clearance on a worker. What it finds goes to supervisor and vehicle
// only, so that a dive does not depend on the machine.

#include <cstdint>

#include "mission/onboard/delayed_worker.h"
#include "planning/certify/certify.h"
#include "planning/world/observed_map.h"
#include "planning/world/world.h"
#include "vehicle/exit_path.h"

namespace dive::mission {

class ExitPathService {
 public:
  static constexpr double kCutoff = 1.5;  ///< Largest clearance reported, m.

  /// `known`: the known map.
  ExitPathService(const planning::World& known, const planning::RobotHull& hull);

  /// The clearance certified for this revision of the path, m; 0 while it is being certified and
  /// without waypoints. Never waits.
  [[nodiscard]] double clearance(const vehicle::ExitPath& path,
                                 const planning::ObservedMap& observed);

 private:
  struct Certified {
    std::int64_t revision = 0;
    double clearance_m = 0.0;
  };
  [[nodiscard]] Certified certify(const vehicle::ExitPath& path,
                                  const planning::ObservedMap& observed);

  // Used by the worker only.
  planning::World known_;
  planning::Certifier certifier_;

  Certified newest_;
  std::int64_t asked_ = 0;  ///< Revision last given to the worker.
  DelayedWorker<Certified> worker_;
};

}  // namespace dive::mission
