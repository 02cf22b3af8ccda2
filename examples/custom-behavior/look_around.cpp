// A behaviour of one's own, dived in the simulator: the state `look` of look.xml, which the mission
// language knows as a hold, turns the vehicle once about the vertical.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "mission/simulation/simulated_conditions.h"
#include "mission/simulation/simulated_dive.h"
#include "mission/states/atomic_state.h"
#include "planning/world/sdf.h"

using namespace dive;

class LookAround final : public behaviors::Behavior {
 public:
  behaviors::BehaviorOutput step(const behaviors::BehaviorInput& input) override {
    if (!begin_) {
      begin_ = input.now;
      X_WB_ = input.estimate->X_WB;
    }
    const double share = to_seconds(input.now - *begin_) / 40.0;
    behaviors::BehaviorOutput output;
    output.command =
        behaviors::station_keeping(-X_WB_.p.z(), to_rpy(X_WB_.q).z() + 2.0 * M_PI * share);
    output.done = share >= 1.0;
    return output;
  }
  const behaviors::Progress& progress() const override { return progress_; }

 private:
  std::optional<Utime> begin_;
  Pose X_WB_;
  behaviors::Progress progress_;
};

class LookAroundState final : public mission::AtomicState {
  std::unique_ptr<behaviors::Behavior> make_behavior(const mission::BehaviorSetup&) const override {
    return std::make_unique<LookAround>();
  }
};

int main(int, char** arguments) {
  Diagnostics diagnostics;
  auto mission = mission::load_mission(arguments[1], diagnostics);
  const auto aqua2 = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  if (!mission || !aqua2) return 2;
  const auto world = planning::load_sdf(mission->map_path, diagnostics);
  for (mission::StateSpec& state : mission->states) {
    if (state.id.value == "look") state.atomic = std::make_shared<LookAroundState>();
  }
  mission::DiveSettings settings;
  settings.conditions = mission::simulated_conditions(*mission);
  double turned = 0.0;
  double yaw = 0.0;
  const auto result =
      mission::simulate_dive(*mission, world.value(), *aqua2, settings,
                             [&](const auto&, const auto& outputs, const auto& truth, const auto&) {
                               const double before = std::exchange(yaw, to_rpy(truth.X_WB.q).z());
                               if (outputs.status.state == "look")
                                 turned += std::remainder(yaw - before, 2.0 * M_PI);
                             });
  fmt::print("{}, turned by {:.0f} degrees\n", result.outcome, rad_to_deg(turned));
}
