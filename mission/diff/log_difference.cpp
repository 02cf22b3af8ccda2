#include "mission/diff/log_difference.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "mission/record/log_channels.h"
#include "mission/record/log_codec.h"
#include "mission/record/output_difference.h"

namespace dive::mission {
namespace {

constexpr std::size_t kInputs = kChannelNames.size();

/// One input of a tick: its packets, by which it is compared, and its value in words.
struct Input {
  std::vector<Packet> packets;
  std::string value;
};
using Inputs = std::array<Input, kInputs>;

class InputReader {
 public:
  explicit InputReader(const StepInputs& inputs) {
    const auto& [now, imu, depth, health, plan, operator_command, obstacles, observed_map,
                 free_ahead, obstacle_ahead, pose_correction, map_correction, map_fix, vision,
                 loss] = inputs;
    static_cast<void>(observed_map);  // made from the obstacles
    if (imu) add(Channel::kAhrs, words(*imu), *imu);
    if (depth) add(Channel::kDepth, fmt::format("{:.3f} m", depth->depth_m), *depth);
    if (health) {
      add(Channel::kHealth,
          fmt::format("battery {:.4f}{}", health->battery_fraction, health->leak ? ", leak" : ""),
          *health);
    }
    if (plan) add(Channel::kPlan, words(plan->plan), now, *plan);
    if (operator_command) {
      add(Channel::kOperator, to_string(*operator_command), now, *operator_command);
    }
    for (const auto& update : obstacles) {
      add(Channel::kObstacles, fmt::format("{} changed cells", update.cells.size()), now, update);
    }
    if (free_ahead) {
      add(Channel::kFreeAhead, fmt::format("{:.3f} m", free_ahead->free_ahead_m), now, *free_ahead);
    }
    if (obstacle_ahead) {
      add(Channel::kObstacleAhead, fmt::format("in {:.2f} s", obstacle_ahead->time_s), now,
          *obstacle_ahead);
    }
    if (pose_correction) {
      add(Channel::kPoseCorrection, words(pose_correction->correction_W), now, *pose_correction);
    }
    if (map_correction) {
      add(Channel::kMapCorrection, fmt::format("{} nodes", map_correction->nodes.size()), now,
          *map_correction);
    }
    if (map_fix) add(Channel::kMapFix, words(map_fix->position_W), now, *map_fix);
    if (vision) add(Channel::kVision, words(vision->estimate.X_WB.p.head<2>()), now, *vision);
    if (loss) {
      add(Channel::kLoss, fmt::format("{} ticks, {} commits", loss->ticks, loss->commits), now,
          *loss);
    }
  }
  [[nodiscard]] Inputs take() { return std::move(inputs_); }

 private:
  static std::string words(const ImuSample& imu) {
    const Eigen::Vector3d rpy = to_rpy(imu.q_WB);
    return fmt::format("roll {:.2f}, pitch {:.2f}, yaw {:.2f} deg", rad_to_deg(rpy.x()),
                       rad_to_deg(rpy.y()), rad_to_deg(rpy.z()));
  }
  static std::string words(const Eigen::Vector2d& W) {
    return fmt::format("({:.3f}, {:.3f}) m", W.x(), W.y());
  }
  static std::string words(const planning::PlanResult& plan) {
    if (!planning::has_path(plan.status)) {
      return fmt::format("{}: {}", planning::to_string(plan.status), plan.reason);
    }
    return fmt::format("{}, {:.2f} m long, clearance {:.2f} m", planning::to_string(plan.status),
                       plan.length_m, plan.clearance_m);
  }
  template <typename... Value>
  void add(Channel channel, std::string value, const Value&... values) {
    Input& input = inputs_[static_cast<std::size_t>(channel)];
    input.value = std::move(value);
    if (!encode(values..., input.packets.emplace_back())) input.packets.back().clear();
  }

  Inputs inputs_;
};

void add_decisions(const LoggedTick& tick, std::vector<Decision>& decisions) {
  const double t_s = to_seconds(tick.inputs.now);
  for (const auto& [rung, cause, competing, why] : tick.outputs.failsafes) {
    decisions.push_back(
        {t_s, "failsafe", fmt::format("rung {} by {}", rung, cause),
         competing.empty() ? why : fmt::format("{}; competing: {}", why, competing)});
  }
  for (const auto& [from, to, event, cause, guards] : tick.outputs.transitions) {
    std::string what = from.empty() ? to : fmt::format("{} -> {}", from, to);
    if (!event.empty()) what += fmt::format(" ({})", event);
    decisions.push_back({t_s, "transition", std::move(what),
                         guards.empty() ? cause : fmt::format("{}; {}", cause, guards)});
  }
  for (const ActionRecord& action : tick.outputs.actions) {
    constexpr const char* kKinds[] = {"log", "payload", "note"};
    decisions.push_back(
        {t_s, "action",
         fmt::format("{}: {}", kKinds[static_cast<std::size_t>(action.kind)], action.text), ""});
  }
  if (const auto& query = tick.outputs.plan_query) {
    const Eigen::Vector3d& goal = query->request.goal.p;
    decisions.push_back({t_s, "plan",
                         fmt::format("{} asks for a plan to ({:.1f}, {:.1f}, {:.1f})", query->state,
                                     goal.x(), goal.y(), goal.z()),
                         query->cause});
  }
}

std::string clipped(const std::string& text) {
  constexpr std::size_t kMaxShown = 100;
  if (text.find('\n') == std::string::npos && text.size() <= kMaxShown) return text;
  return fmt::format("{} bytes", text.size());
}

std::vector<Difference> compare_headers(const std::optional<LogHeader>& a,
                                        const std::optional<LogHeader>& b) {
  const LogHeader none;
  const LogHeader& one = a ? *a : none;
  const LogHeader& other = b ? *b : none;
  std::vector<Difference> differences;
  const auto compare = [&](const char* what, const std::string& first, const std::string& second) {
    if (first != second) differences.push_back({what, clipped(first), clipped(second)});
  };
  compare("version", one.version, other.version);
  compare("mathematics", one.mathematics, other.mathematics);
  compare("seed", fmt::to_string(one.seed), fmt::to_string(other.seed));
  compare("check", one.check, other.check);
  compare("mission", one.mission_xml, other.mission_xml);
  compare("map", one.map_xml, other.map_xml);
  compare("meshes of the map", one.map_meshes, other.map_meshes);
  compare("vehicle", one.vehicle_urdf, other.vehicle_urdf);
  compare("journal", one.resume, other.resume);
  compare("gap before the dive continued", fmt::format("{} s", one.resume_gap_s.value_or(0.0)),
          fmt::format("{} s", other.resume_gap_s.value_or(0.0)));
  return differences;
}

/// Compares ticks of the same number while their times agree.
class TickComparison {
 public:
  explicit TickComparison(LogComparison& result) : result_(result) {}

  void compare(const std::optional<LoggedTick>& a, const std::optional<LoggedTick>& b) {
    if (!a && !b) return;
    const Utime now = a ? a->inputs.now : b->inputs.now;
    if (!a || !b || a->inputs.now != b->inputs.now) {
      differ("tick", now, a ? "there" : "", b ? "there" : "");
      return;
    }
    if (has_shifted_) return;
    compare_inputs(InputReader(a->inputs).take(), InputReader(b->inputs).take(), now);
    if (!result_.output.empty()) return;
    result_.output = first_difference(a->outputs, b->outputs, {"A", "B"});
    if (result_.output.empty()) return;
    result_.output = fmt::format("t = {:.2f} s: {}", to_seconds(now), result_.output);
  }

 private:
  void compare_inputs(const Inputs& a, const Inputs& b, Utime now) {
    for (std::size_t i = 0; i < kInputs; ++i) {
      if (a[i].packets == b[i].packets) continue;
      differ(std::string(kChannelNames[i]), now, a[i].value, b[i].value);
    }
  }
  void differ(const std::string& input, Utime now, std::string a, std::string b) {
    has_shifted_ = has_shifted_ || input == "tick";
    if (std::ranges::find(result_.inputs, input, &InputDifference::input) != result_.inputs.end()) {
      return;
    }
    result_.inputs.push_back({input, to_seconds(now), std::move(a), std::move(b)});
  }

  LogComparison& result_;
  bool has_shifted_ = false;  // From here on ticks of the same number are not of the same time.
};

void compare_decisions(const std::vector<Decision>& a, const std::vector<Decision>& b,
                       LogComparison& result) {
  const auto same = [](const Decision& one, const Decision& other) {
    return one.kind == other.kind && one.what == other.what;
  };
  const auto [in_a, in_b] = std::ranges::mismatch(a, b, same);
  result.common_decisions = static_cast<std::size_t>(in_a - a.begin());
  if (in_a != a.begin()) result.last_common = *(in_a - 1);
  if (in_a != a.end()) result.a = *in_a;
  if (in_b != b.end()) result.b = *in_b;
}

}  // namespace

LogComparison compare_logs(LogReader& a, LogReader& b) {
  LogComparison result;
  result.header = compare_headers(a.header(), b.header());
  std::vector<Decision> decisions_a;
  std::vector<Decision> decisions_b;
  TickComparison ticks(result);
  while (true) {
    const std::optional<LoggedTick> tick_a = a.next();
    const std::optional<LoggedTick> tick_b = b.next();
    if (!tick_a && !tick_b) break;
    if (tick_a) {
      add_decisions(*tick_a, decisions_a);
      result.duration_a_s = to_seconds(tick_a->inputs.now);
    }
    if (tick_b) {
      add_decisions(*tick_b, decisions_b);
      result.duration_b_s = to_seconds(tick_b->inputs.now);
    }
    ticks.compare(tick_a, tick_b);
  }
  compare_decisions(decisions_a, decisions_b, result);
  result.is_damaged =
      !a.gaps().empty() || !b.gaps().empty() || a.torn() || b.torn() || !a.header() || !b.header();
  result.is_equal = result.header.empty() && result.inputs.empty() && result.output.empty() &&
                    !result.decides_otherwise() && !result.is_damaged;
  return result;
}

}  // namespace dive::mission
