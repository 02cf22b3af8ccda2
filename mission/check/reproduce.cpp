#include "mission/check/reproduce.h"

#include <algorithm>

#include <fmt/format.h>

#include "mission/simulation/simulated_conditions.h"

namespace dive::mission {
namespace {

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("/._-+,:@%").find(c) != std::string_view::npos;
}

// Quoted for a POSIX shell.
std::string in_quotes(const std::string& word) {
  if (!word.empty() && std::ranges::all_of(word, is_plain)) return word;
  std::string result = "'";
  for (const char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

}  // namespace

std::string run_command_for(const Mission& mission, const DiveSettings& settings) {
  // fmt's "{}" of a double is the shortest text that parses to the same double.
  std::string command =
      fmt::format("dive run {} --seed {}", in_quotes(mission.source.path()), settings.seed);
  if (!settings.vehicle_path.empty()) {
    command += fmt::format(" --vehicle {}", in_quotes(settings.vehicle_path));
  }
  const auto defaults = simulated_conditions(mission).list();
  const auto conditions = settings.conditions.list();
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    const auto& [name, value] = conditions[i];
    if (value != defaults[i].second) command += fmt::format(" --set {}={}", name, value);
  }
  for (const Fault& fault : settings.faults) {
    command += fmt::format(" --fault {}@{}", to_string(fault.kind), fault.at_s);
  }
  return command;
}

}  // namespace dive::mission
