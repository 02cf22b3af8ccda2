#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/terminal.h"
#include "mission/cli/work_progress.h"
#include "mission/record/explain.h"

namespace dive::mission {

int run_explain(const ExplainArguments& arguments) {
  std::optional<LogReader> log = open_log(arguments.log);
  if (!log) return kExitUsage;
  SteadyClock clock;
  WorkProgress progress(clock, "reading", arguments.json);
  log->observe([&](double share) { progress.show(share); });
  const Explanation explanation = explain(*log);
  if (arguments.json) {
    nlohmann::ordered_json events = nlohmann::ordered_json::array();
    for (const Explained& event : explanation.events) {
      events.push_back({{"t", event.t_s},
                        {"kind", to_string(event.kind)},
                        {"state", event.state},
                        {"what", event.what},
                        {"reason", event.reason}});
    }
    print_json({{"duration_s", explanation.duration_s},
                {"check", log->header() ? log->header()->check : ""},
                {"torn", explanation.torn},
                {"gaps", to_json(explanation.gaps)},
                {"collision_list", to_json(explanation.collisions)},
                {"events", std::move(events)}});
    return kExitSuccess;
  }
  for (const Explained& event : explanation.events) {
    print(fmt::format("{:8.2f} s  {}", event.t_s, event.what));
    if (!event.reason.empty()) print(fmt::format("              {}", event.reason));
  }
  if (!explanation.gaps.empty()) {
    note(fmt::format("the log is damaged: {} gap(s)", explanation.gaps.size()));
  }
  if (log->header() && !log->header()->check.empty()) {
    note(fmt::format("how the mission was checked: {}", log->header()->check));
  }
  if (explanation.torn) note("the log is torn: it ends before the dive did");
  return kExitSuccess;
}

}  // namespace dive::mission
