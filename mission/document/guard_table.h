#pragma once
// The variables and comparisons of guards, by index. Shared by guard.cpp and guard_parser.cpp.

#include <array>
#include <string_view>

namespace dive::mission {

struct GuardVariable {
  std::string_view name;
  bool is_truth = false;
};

enum class GuardVariableIndex {
  kDepth,
  kAltitude,
  kBatteryFraction,
  kElapsed,
  kStateElapsed,
  kDistanceToGoal,
  kClearance,
  kOverhead
};

/// In the order of GuardVariableIndex.
inline constexpr std::array<GuardVariable, 8> kGuardVariables = {{{"depth"},
                                                                  {"altitude"},
                                                                  {"battery_fraction"},
                                                                  {"elapsed"},
                                                                  {"state_elapsed"},
                                                                  {"distance_to_goal"},
                                                                  {"clearance"},
                                                                  {"overhead", true}}};

enum class GuardComparison { kLess, kLessEqual, kGreater, kGreaterEqual, kEqual, kNotEqual };

/// In the order of GuardComparison.
inline constexpr std::array<std::string_view, 6> kGuardComparisons = {"<",  "<=", ">",
                                                                      ">=", "==", "!="};

}  // namespace dive::mission
