#include <functional>
#include <iostream>
#include <optional>
#include <utility>

#include "common/clock.h"
#include "mission/check/check.h"
#include "mission/cli/commands.h"
#include "mission/cli/loading.h"
#include "mission/language_server/language_server.h"
#include "mission/simulation/simulated_conditions.h"

namespace dive::mission {
namespace {

/// Leaves a check whose text has changed meanwhile.
struct Outdated {};

class StopWhenOutdated final : public CheckObserver {
 public:
  explicit StopWhenOutdated(const std::function<bool()>& is_outdated) : is_outdated_(is_outdated) {}

  void on_step(const std::string& /*what*/) override { stop_if_outdated(); }
  void on_progress(double /*done*/, double /*total*/, const std::string& /*unit*/,
                   double /*share*/) override {
    stop_if_outdated();
  }

 private:
  void stop_if_outdated() const {
    if (is_outdated_()) throw Outdated{};
  }

  const std::function<bool()>& is_outdated_;
};

CheckedLeg checked(const PlannedRouteLeg& leg, double required_m) {
  return {.state = leg.state,
          .goal = leg.goal,
          .has_path = leg.plan.accepted,
          .reason = leg.plan.reason,
          .clearance_m = leg.plan.clearance_m,
          .required_m = required_m,
          .length_m = leg.plan.length_m,
          .margin_sigma = leg.margin.margin_sigma,
          .obstacle = leg.margin.obstacle_name};
}

// As `dive check --static`.
std::optional<CheckedText> check_text(const SourceText& text,
                                      const std::function<bool()>& is_outdated) {
  CheckedText result;
  Diagnostics diagnostics;
  const std::optional<LoadedMission> loaded =
      load(text, planning::Resources::kInFolder, diagnostics);
  if (loaded) {
    CheckOptions options;
    options.simulate = false;
    options.dive.conditions = simulated_conditions(loaded->mission);
    SteadyClock clock;
    StopWhenOutdated observer(is_outdated);
    try {
      const CheckReport report = check_mission(loaded->mission, loaded->world, loaded->model,
                                               options, diagnostics, observer, clock);
      for (const PlannedRouteLeg& leg : report.legs) {
        result.legs.push_back(checked(leg, loaded->mission.limits.clearance.value));
      }
    } catch (const Outdated&) {
      return std::nullopt;
    }
  }
  diagnostics.sort();
  result.findings = diagnostics.list();
  return result;
}

}  // namespace

int run_lsp() {
  std::ios::sync_with_stdio(false);
  // A tied input flushes the output before each read, while the checking thread writes to it.
  std::cin.tie(nullptr);
  return LanguageServer(std::cin, std::cout, DIVE_VERSION, check_text).serve();
}

}  // namespace dive::mission
