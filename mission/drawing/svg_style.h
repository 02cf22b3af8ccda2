#pragma once
// Colours and formats of a drawing. Internal to mission/drawing.

#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace dive::mission {

// Colours by Okabe and Ito (2008), distinguishable with every kind of colour vision.
inline constexpr std::array<std::string_view, 6> kLegColors{"#0072b2", "#e69f00", "#009e73",
                                                            "#cc79a7", "#56b4e9", "#8c6d1f"};
inline constexpr std::string_view kSwum =
    R"(stroke="#1a1a1a" stroke-width="1.8" stroke-linejoin="round")";
inline constexpr std::string_view kEstimated =
    R"(stroke="#d55e00" stroke-width="1.6" stroke-dasharray="6 4")";
inline constexpr std::string_view kWaypointTick = R"(stroke="#0072b2" stroke-width="2")";
inline constexpr std::string_view kLimitColor = "#b3261e";
inline constexpr std::string_view kNarrow =
    R"(stroke="#b3261e" stroke-width="5" stroke-linecap="round")";
inline constexpr std::string_view kBeside =
    R"(fill="#9aa1ab" stroke="#5b626c" stroke-width="1" stroke-linejoin="round")";
inline constexpr std::string_view kBehind =
    R"(fill="#c9c2b2" fill-opacity="0.30" stroke="#8d8676" stroke-opacity="0.6" stroke-width="1")";
inline constexpr std::string_view kInFront =
    R"(fill="#5b626c" fill-opacity="0.06" stroke="#5b626c" stroke-width="1.2" stroke-dasharray="7 4")";

inline std::string_view leg_color(std::size_t leg) { return kLegColors[leg % kLegColors.size()]; }

/// A length as text, or a dash if there is none.
inline std::string metres(double value) {
  return std::isfinite(value) ? fmt::format("{:.2f} m", value) : std::string("–");
}

}  // namespace dive::mission
