// Structured bindings unpack all members, so that a new member does not compile until it is
// compared.

#include <array>
#include <bit>
#include <cstdint>
#include <iterator>
#include <string>
#include <type_traits>

#include <fmt/format.h>

#include "mission/record/log.h"
#include "mission/record/log_channels.h"
#include "mission/record/output_difference.h"

namespace dive::mission {
namespace {

template <typename T>
bool same(const T& a, const T& b) {
  return a == b;
}
bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

template <typename T>
std::string shown(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return fmt::format("{}", static_cast<int>(value));
  } else if constexpr (std::is_same_v<T, std::string>) {
    return fmt::format("'{}'", value);
  } else {
    return fmt::format("{}", value);
  }
}

/// Keeps the first difference. Names are composed only then.
class Comparison {
 public:
  explicit Comparison(const OutputNames& names) : names_(names) {}

  template <typename T, typename... Name>
  void value(const T& logged, const T& replayed, const Name&... name) {
    if (!text_.empty() || same(logged, replayed)) return;
    (fmt::format_to(std::back_inserter(text_), "{}", name), ...);
    std::string a = shown(logged);
    std::string b = shown(replayed);
    if constexpr (std::is_same_v<T, double>) {
      if (a == b) {  // NaNs with different bits
        a += fmt::format(" ({:#x})", std::bit_cast<std::uint64_t>(logged));
        b += fmt::format(" ({:#x})", std::bit_cast<std::uint64_t>(replayed));
      }
    }
    text_ += fmt::format(": {} {}, {} {}", names_.first, a, names_.second, b);
  }

  template <typename... Name>
  void vector(const Eigen::Vector3d& logged, const Eigen::Vector3d& replayed, const Name&... name) {
    value(logged.x(), replayed.x(), name..., ".x");
    value(logged.y(), replayed.y(), name..., ".y");
    value(logged.z(), replayed.z(), name..., ".z");
  }
  template <typename... Name>
  void quaternion(const Eigen::Quaterniond& logged, const Eigen::Quaterniond& replayed,
                  const Name&... name) {
    value(logged.x(), replayed.x(), name..., ".x");
    value(logged.y(), replayed.y(), name..., ".y");
    value(logged.z(), replayed.z(), name..., ".z");
    value(logged.w(), replayed.w(), name..., ".w");
  }
  template <typename... Name>
  void pose(const Pose& logged, const Pose& replayed, const Name&... name) {
    const auto& [p1, q1] = logged;
    const auto& [p2, q2] = replayed;
    vector(p1, p2, name..., ".p");
    quaternion(q1, q2, name..., ".q");
  }
  /// True if the sizes are equal, so that their elements can be compared.
  template <typename List, typename... Name>
  bool sizes(const List& logged, const List& replayed, const Name&... name) {
    value(logged.size(), replayed.size(), name..., ".count");
    return logged.size() == replayed.size();
  }

  template <typename... Name>
  void poses(const std::vector<Pose>& logged, const std::vector<Pose>& replayed,
             const Name&... name) {
    if (!sizes(logged, replayed, name...)) return;
    for (std::size_t i = 0; i < logged.size(); ++i) {
      pose(logged[i], replayed[i], name..., "[", i, "]");
    }
  }

  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  OutputNames names_;
  std::string text_;
};

void compare(Comparison& c, const vehicle::Command& logged, const vehicle::Command& replayed) {
  constexpr std::string_view kName = to_string(Channel::kCommand);
  const auto& [v1, h1, d1, o1] = logged;
  const auto& [v2, h2, d2, o2] = replayed;
  c.value(v1, v2, kName, ".v");
  c.value(h1, h2, kName, ".h");
  c.value(d1, d2, kName, ".d");
  c.quaternion(o1, o2, kName, ".o");
}

void compare(Comparison& c, const vehicle::PseudoRates& logged,
             const vehicle::PseudoRates& replayed) {
  constexpr std::string_view kName = to_string(Channel::kRates);
  const auto& [surge1, heave1, roll1, pitch1, yaw1] = logged;
  const auto& [surge2, heave2, roll2, pitch2, yaw2] = replayed;
  c.value(surge1, surge2, kName, ".surge");
  c.value(heave1, heave2, kName, ".heave");
  c.value(roll1, roll2, kName, ".roll");
  c.value(pitch1, pitch2, kName, ".pitch");
  c.value(yaw1, yaw2, kName, ".yaw");
}

void compare(Comparison& c, const estimation::StateEstimate& logged,
             const estimation::StateEstimate& replayed) {
  constexpr std::string_view kName = to_string(Channel::kEstimate);
  const auto& [utime1, valid1, source1, X_WB1, v1, omega1, covariance1, correction1] = logged;
  const auto& [utime2, valid2, source2, X_WB2, v2, omega2, covariance2, correction2] = replayed;
  c.value(utime1, utime2, kName, ".utime");
  c.value(valid1, valid2, kName, ".valid");
  c.value(source1, source2, kName, ".source");
  c.pose(X_WB1, X_WB2, kName, ".X_WB");
  c.vector(v1, v2, kName, ".v_WB_B");
  c.vector(omega1, omega2, kName, ".omega_WB_B");
  c.value(correction1.yaw, correction2.yaw, kName, ".map_from_odom.yaw");
  c.value(correction1.translation.x(), correction2.translation.x(), kName, ".map_from_odom.x");
  c.value(correction1.translation.y(), correction2.translation.y(), kName, ".map_from_odom.y");
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      c.value(covariance1(row, column), covariance2(row, column), kName, ".covariance(", row, ",",
              column, ")");
    }
  }
}

void compare(Comparison& c, const Status& logged, const Status& replayed) {
  constexpr std::string_view kName = to_string(Channel::kStatus);
  const auto& [state1, goal1, distance1, time1, depth1, clearance1, cross_track1, margin1, segment1,
               rung1, finished1] = logged;
  const auto& [state2, goal2, distance2, time2, depth2, clearance2, cross_track2, margin2, segment2,
               rung2, finished2] = replayed;
  c.value(state1, state2, kName, ".state");
  c.value(goal1, goal2, kName, ".goal");
  c.value(distance1, distance2, kName, ".distance_to_go_m");
  c.value(time1, time2, kName, ".time_to_go_s");
  c.value(depth1, depth2, kName, ".depth_m");
  c.value(clearance1, clearance2, kName, ".clearance_m");
  c.value(cross_track1, cross_track2, kName, ".cross_track_m");
  c.value(margin1, margin2, kName, ".margin_sigma");
  c.value(segment1, segment2, kName, ".segment");
  c.value(rung1, rung2, kName, ".rung");
  c.value(finished1, finished2, kName, ".finished");
}

void compare(Comparison& c, const planning::MotionLimits& logged,
             const planning::MotionLimits& replayed, std::string_view name) {
  const auto& [attitude1, clearance1, reduced1, min_z1, max_z1, altitude1, tolerance1] = logged;
  const auto& [attitude2, clearance2, reduced2, min_z2, max_z2, altitude2, tolerance2] = replayed;
  c.value(attitude1, attitude2, name, ".attitude");
  c.value(clearance1, clearance2, name, ".clearance");
  c.value(reduced1, reduced2, name, ".reduced_clearance");
  c.value(min_z1, min_z2, name, ".min_z");
  c.value(max_z1, max_z2, name, ".max_z");
  c.value(altitude1, altitude2, name, ".min_altitude");
  c.value(tolerance1, tolerance2, name, ".goal_tolerance");
}

void compare(Comparison& c, const PlanQuery& logged, const PlanQuery& replayed) {
  constexpr std::string_view kName = to_string(Channel::kPlanQuery);
  const auto& [id1, state1, cause1, request1] = logged;
  const auto& [id2, state2, cause2, request2] = replayed;
  const auto& [start1, goal1, fixed1, limits1, seed1, previous1, trail1] = request1;
  const auto& [start2, goal2, fixed2, limits2, seed2, previous2, trail2] = request2;
  c.value(id1, id2, kName, ".id");
  c.value(state1, state2, kName, ".state");
  c.value(cause1, cause2, kName, ".cause");
  c.pose(start1, start2, kName, ".start");
  c.pose(goal1, goal2, kName, ".goal");
  c.value(fixed1, fixed2, kName, ".goal_attitude_fixed");
  compare(c, limits1, limits2, kName);
  c.value(seed1, seed2, kName, ".seed");
  c.poses(previous1, previous2, kName, ".previous");
  c.poses(trail1, trail2, kName, ".trail");
}

void compare(Comparison& c, const std::optional<PlanQuery>& logged,
             const std::optional<PlanQuery>& replayed) {
  c.value(logged.has_value(), replayed.has_value(), to_string(Channel::kPlanQuery), ".present");
  if (logged && replayed) compare(c, *logged, *replayed);
}

void compare(Comparison& c, const std::vector<TransitionRecord>& logged,
             const std::vector<TransitionRecord>& replayed) {
  constexpr std::string_view kName = to_string(Channel::kTransition);
  for (std::size_t i = 0; i < logged.size() && i < replayed.size(); ++i) {
    const auto& [from1, to1, event1, cause1, guards1] = logged[i];
    const auto& [from2, to2, event2, cause2, guards2] = replayed[i];
    c.value(from1, from2, kName, "[", i, "].from");
    c.value(to1, to2, kName, "[", i, "].to");
    c.value(event1, event2, kName, "[", i, "].event");
    c.value(cause1, cause2, kName, "[", i, "].cause");
    c.value(guards1, guards2, kName, "[", i, "].guards");
  }
  c.sizes(logged, replayed, kName);
}

void compare(Comparison& c, const std::vector<FailsafeRecord>& logged,
             const std::vector<FailsafeRecord>& replayed) {
  constexpr std::string_view kName = to_string(Channel::kFailsafe);
  for (std::size_t i = 0; i < logged.size() && i < replayed.size(); ++i) {
    const auto& [rung1, cause1, competing1, why1] = logged[i];
    const auto& [rung2, cause2, competing2, why2] = replayed[i];
    c.value(rung1, rung2, kName, "[", i, "].rung");
    c.value(cause1, cause2, kName, "[", i, "].cause");
    c.value(competing1, competing2, kName, "[", i, "].competing");
    c.value(why1, why2, kName, "[", i, "].why");
  }
  c.sizes(logged, replayed, kName);
}

void compare(Comparison& c, const std::vector<ActionRecord>& logged,
             const std::vector<ActionRecord>& replayed) {
  constexpr std::string_view kName = to_string(Channel::kAction);
  for (std::size_t i = 0; i < logged.size() && i < replayed.size(); ++i) {
    const auto& [kind1, text1, once1] = logged[i];
    const auto& [kind2, text2, once2] = replayed[i];
    c.value(kind1, kind2, kName, "[", i, "].kind");
    c.value(text1, text2, kName, "[", i, "].text");
    c.value(once1, once2, kName, "[", i, "].once");
  }
  c.sizes(logged, replayed, kName);
}

}  // namespace

std::string first_difference(const StepOutputs& logged, const StepOutputs& replayed,
                             const OutputNames& names) {
  const auto& [command1, rates1, estimate1, status1, query1, transitions1, failsafes1, actions1] =
      logged;
  const auto& [command2, rates2, estimate2, status2, query2, transitions2, failsafes2, actions2] =
      replayed;
  Comparison c(names);
  compare(c, command1, command2);
  compare(c, rates1, rates2);
  compare(c, estimate1, estimate2);
  compare(c, status1, status2);
  compare(c, query1, query2);
  compare(c, transitions1, transitions2);
  compare(c, failsafes1, failsafes2);
  compare(c, actions1, actions2);
  return c.take();
}

std::string first_difference(const StepOutputs& logged, const StepOutputs& replayed) {
  return first_difference(logged, replayed, {});
}

}  // namespace dive::mission
