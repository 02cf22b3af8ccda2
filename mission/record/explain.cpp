#include "mission/record/explain.h"

#include <utility>

#include <fmt/format.h>

#include "planning/world/primitives.h"

namespace dive::mission {
namespace {

class Explainer {
 public:
  explicit Explainer(Explanation& explanation) : explanation_(explanation) {}

  void gap(const LogGap& gap) {
    t_s_ = to_seconds(gap.from);
    const std::string until =
        gap.to ? fmt::format("from {:.2f} s to {:.2f} s", t_s_, to_seconds(*gap.to))
               : fmt::format("from {:.2f} s to the end", t_s_);
    add(Kind::kGap, fmt::format("the log is damaged: nothing is known {}", until),
        fmt::format("{} bytes at offset {} cannot be used", gap.bytes, gap.offset));
  }

  void tick(const LoggedTick& tick) {
    t_s_ = to_seconds(tick.inputs.now);
    state_ = tick.outputs.status.state;
    explanation_.duration_s = t_s_;
    inputs(tick.inputs);
    for (const FailsafeRecord& record : tick.outputs.failsafes) failsafe(record);
    for (const TransitionRecord& record : tick.outputs.transitions) transition(record);
    for (const ActionRecord& record : tick.outputs.actions) action(record);
    if (tick.outputs.plan_query) query(*tick.outputs.plan_query);
    if (tick.truth) collisions(*tick.truth, tick.outputs.estimate);
  }

 private:
  using Kind = Explained::Kind;

  void add(Kind kind, std::string what, std::string because = {}) {
    explanation_.events.push_back({kind, t_s_, state_, std::move(what), std::move(because)});
  }

  void inputs(const StepInputs& inputs) {
    if (const auto& command = inputs.operator_command;
        command && *command != OperatorCommand::kHeartbeat) {
      add(Kind::kOperator, *command <= kLastTopsideCommand
                               ? fmt::format("topside commanded {}", to_string(*command))
                               : fmt::format("{} to the executive", to_string(*command)));
    }
    for (const planning::ObstacleUpdate& update : inputs.obstacles) obstacles(update);
    if (inputs.plan) answer(*inputs.plan);
  }

  // Not of a mapper, which adds and removes obstacles all the time. What is gone or back is a note.
  void obstacles(const planning::ObstacleUpdate& update) {
    if (update.source != planning::ObstacleSource::kScript) return;
    for (const planning::MapCell& cell : update.cells) {
      Eigen::AlignedBox3d box;
      for (const planning::Polytope& piece : cell.pieces) box.extend(planning::bounding_box(piece));
      if (box.isEmpty()) continue;
      const Eigen::Vector3d centre = box.center();
      add(Kind::kMap, fmt::format("an obstacle is observed at ({:.1f}, {:.1f}, {:.1f})", centre.x(),
                                  centre.y(), centre.z()));
    }
  }

  void answer(const PlanReply& reply) {
    const double took = t_s_ - asked_at_s_;
    const planning::PlanResult& plan = reply.plan;
    if (planning::has_path(plan.status)) {
      std::string how = plan.reason;
      if (plan.warm_starts > 0) {
        how += fmt::format("{}{} warm start(s)", how.empty() ? "" : "; ", plan.warm_starts);
      }
      const bool is_reduced = plan.status == planning::PlanStatus::kReduced;
      add(Kind::kAnswer,
          fmt::format("plan {} after {:.2f} s: {}{:.1f} m, certified {:.2f} m", reply.id, took,
                      is_reduced ? "reduced, " : "", plan.length_m, plan.clearance_m),
          std::move(how));
    } else {
      add(Kind::kAnswer,
          fmt::format("plan {} after {:.2f} s: {}", reply.id, took,
                      planning::to_string(plan.status)),
          plan.reason);
    }
  }

  void query(const PlanQuery& query) {
    asked_at_s_ = t_s_;
    const Eigen::Vector3d& goal = query.request.goal.p;
    add(Kind::kPlan,
        fmt::format("{} asks for plan {} to ({:.1f}, {:.1f}, {:.1f}) with {:.2f} m clearance",
                    query.state, query.id, goal.x(), goal.y(), goal.z(),
                    query.request.limits.clearance),
        query.cause);
  }

  void transition(const TransitionRecord& record) {
    const std::string way =
        record.from.empty() ? record.to : fmt::format("{} -> {}", record.from, record.to);
    std::string because = record.cause;
    if (!record.event.empty()) because = fmt::format("{}: {}", record.event, because);
    if (!record.guards.empty()) because += fmt::format("; {}", record.guards);
    add(Kind::kTransition, way, std::move(because));
  }

  void failsafe(const FailsafeRecord& record) {
    std::string because = fmt::format("{}: {}", record.cause, record.why);
    if (!record.competing.empty()) because += fmt::format("; competing: {}", record.competing);
    add(Kind::kFailsafe, fmt::format("rung {}", record.rung), std::move(because));
  }

  void action(const ActionRecord& record) {
    constexpr const char* kWhat[] = {"log: {}", "payload: {}", "note: {}"};
    add(Kind::kAction,
        fmt::format(fmt::runtime(kWhat[static_cast<int>(record.kind)]), record.text));
  }

  void collisions(const TruthRecord& truth, const estimation::StateEstimate& estimate) {
    for (Collision& collision : collisions_at(truth.utime, truth.X_WB, truth.contacts, estimate)) {
      add(Kind::kCollision, "collision " + describe(collision));
      explanation_.collisions.push_back(std::move(collision));
    }
  }

  Explanation& explanation_;
  double t_s_ = 0.0;
  double asked_at_s_ = 0.0;
  std::string state_;
};

}  // namespace

Explanation explain(LogReader& log) {
  Explanation explanation;
  Explainer explainer(explanation);
  std::size_t gaps = 0;
  const auto add_gaps = [&] {
    for (; gaps < log.gaps().size(); ++gaps) explainer.gap(log.gaps()[gaps]);
  };
  while (const std::optional<LoggedTick> tick = log.next()) {
    add_gaps();
    explainer.tick(*tick);
  }
  add_gaps();
  explanation.gaps = log.gaps();
  explanation.torn = log.torn();
  return explanation;
}

const char* to_string(Explained::Kind kind) {
  constexpr const char* kNames[] = {"transition", "failsafe", "plan",      "answer", "action",
                                    "operator",   "map",      "collision", "gap"};
  return kNames[static_cast<int>(kind)];
}

}  // namespace dive::mission
