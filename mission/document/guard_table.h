#pragma once
// The variables, units and comparisons of guards. Shared by guard.cpp and guard_parser.cpp.

#include <array>
#include <string_view>

#include "mission/document/guard.h"

namespace dive::mission {

/// The kind of a part of a guard. Only parts of the same kind are compared.
enum class GuardKind {
  kTruth,
  kNumber,  ///< Without a unit: compatible with every kind except truth and estimator.
  kLength,
  kTime,
  kFraction,
  kTemperature,
  kEstimator,
};

/// With its article, for messages.
[[nodiscard]] constexpr std::string_view name_of(GuardKind kind) {
  constexpr std::string_view kNames[] = {"true or false", "a number",      "a length",    "a time",
                                         "a fraction",    "a temperature", "an estimator"};
  return kNames[static_cast<std::size_t>(kind)];
}

struct GuardVariable {
  std::string_view name;
  GuardKind kind;
  double (*value)(const GuardVariables&);
};

inline constexpr std::array kGuardVariables = {
    GuardVariable{"depth", GuardKind::kLength, [](const GuardVariables& v) { return v.depth; }},
    GuardVariable{"altitude", GuardKind::kLength,
                  [](const GuardVariables& v) { return v.altitude; }},
    GuardVariable{"battery_fraction", GuardKind::kFraction,
                  [](const GuardVariables& v) { return v.battery_fraction; }},
    GuardVariable{"temperature", GuardKind::kTemperature,
                  [](const GuardVariables& v) { return v.temperature; }},
    GuardVariable{"elapsed", GuardKind::kTime, [](const GuardVariables& v) { return v.elapsed; }},
    GuardVariable{"state_elapsed", GuardKind::kTime,
                  [](const GuardVariables& v) { return v.state_elapsed; }},
    GuardVariable{"distance_to_goal", GuardKind::kLength,
                  [](const GuardVariables& v) { return v.distance_to_goal; }},
    GuardVariable{"clearance", GuardKind::kLength,
                  [](const GuardVariables& v) { return v.clearance; }},
    GuardVariable{"cross_track", GuardKind::kLength,
                  [](const GuardVariables& v) { return v.cross_track; }},
    GuardVariable{"position_sigma", GuardKind::kLength,
                  [](const GuardVariables& v) { return v.position_sigma; }},
    GuardVariable{"penetration", GuardKind::kLength,
                  [](const GuardVariables& v) { return v.penetration; }},
    GuardVariable{"budget_used", GuardKind::kFraction,
                  [](const GuardVariables& v) { return v.budget_used; }},
    GuardVariable{"overhead", GuardKind::kTruth,
                  [](const GuardVariables& v) { return v.overhead ? 1.0 : 0.0; }},
    GuardVariable{"estimator", GuardKind::kEstimator,
                  [](const GuardVariables& v) { return static_cast<double>(v.estimator); }},
};

struct GuardConstant {
  std::string_view name;
  GuardKind kind;
  double value;
};

inline constexpr std::array kGuardConstants = {
    GuardConstant{"primitive", GuardKind::kEstimator,
                  static_cast<double>(EstimatorName::kPrimitive)},
    GuardConstant{"visual_inertial", GuardKind::kEstimator,
                  static_cast<double>(EstimatorName::kVisualInertial)},
};

inline constexpr std::array kGuardUnits = {
    GuardConstant{"m", GuardKind::kLength, 1.0},    GuardConstant{"cm", GuardKind::kLength, 0.01},
    GuardConstant{"km", GuardKind::kLength, 1e3},   GuardConstant{"s", GuardKind::kTime, 1.0},
    GuardConstant{"min", GuardKind::kTime, 60.0},   GuardConstant{"h", GuardKind::kTime, 3600.0},
    GuardConstant{"%", GuardKind::kFraction, 0.01},
};

enum class GuardComparison { kLess, kLessEqual, kGreater, kGreaterEqual, kEqual, kNotEqual };

/// In the order of GuardComparison.
inline constexpr std::array<std::string_view, 6> kGuardComparisons = {"<",  "<=", ">",
                                                                      ">=", "==", "!="};

}  // namespace dive::mission
