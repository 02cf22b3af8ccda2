#include "mission/cli/json.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/terminal.h"

namespace dive::mission {

using Json = nlohmann::ordered_json;

Json to_json(const Diagnostics& diagnostics) {
  Json list = Json::array();
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    list.push_back({{"code", diagnostic.code},
                    {"severity", to_string(diagnostic.severity)},
                    {"file", diagnostic.file},
                    {"line", diagnostic.span.line},
                    {"column", diagnostic.span.column},
                    {"message", diagnostic.message},
                    {"hint", diagnostic.hint}});
    if (!diagnostic.included_from.empty()) {
      list.back()["included_from"] = diagnostic.included_from;
    }
  }
  return list;
}

Json to_sarif(const Diagnostics& diagnostics, std::span<const Rule> rules) {
  Json described = Json::array();
  for (const Rule& rule : rules) {
    described.push_back({{"id", rule.code}, {"shortDescription", {{"text", rule.sentence}}}});
  }
  Json results = Json::array();
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    const std::string text = diagnostic.hint.empty()
                                 ? diagnostic.message
                                 : diagnostic.message + " (" + diagnostic.hint + ")";
    results.push_back({{"ruleId", diagnostic.code},
                       {"level", diagnostic.severity == Severity::kError ? "error" : "warning"},
                       {"message", {{"text", text}}},
                       {"locations",
                        {{{"physicalLocation",
                           {{"artifactLocation", {{"uri", diagnostic.file}}},
                            {"region",
                             {{"startLine", std::max(diagnostic.span.line, 1)},
                              {"startColumn", std::max(diagnostic.span.column, 1)},
                              {"endColumn", std::max(diagnostic.span.column, 1) +
                                                std::max(diagnostic.span.length, 1)}}}}}}}}});
  }
  return {{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
          {"version", "2.1.0"},
          {"runs",
           {{{"tool",
              {{"driver",
                {{"name", "dive"}, {"version", DIVE_VERSION}, {"rules", std::move(described)}}}}},
             {"results", std::move(results)}}}}};
}

Json to_json(const planning::PlanResult& plan, const planning::PlannerStatistics& statistics) {
  Json waypoints = Json::array();
  for (const Pose& pose : plan.waypoints) {
    waypoints.push_back(
        {pose.p.x(), pose.p.y(), pose.p.z(), pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()});
  }
  Json reduced = nullptr;
  if (plan.reduced) {
    const Eigen::Vector3d& p = plan.reduced->place_W;
    reduced = {{"length_m", plan.reduced->length_m},
               {"clearance_m", plan.clearance_m},
               {"x", p.x()},
               {"y", p.y()},
               {"z", p.z()},
               {"obstacle", plan.reduced->obstacle},
               {"accepted", plan.accepted}};
  }
  return {{"status", planning::to_string(plan.status)},
          {"reason", plan.reason},
          {"reduced", std::move(reduced)},
          {"clearance_m", plan.clearance_m},
          {"length_m", plan.length_m},
          {"time_ms", statistics.total_ms},
          {"warm_starts", plan.warm_starts},
          {"iterations", statistics.iterations},
          {"stages_ms",
           {{"optimise", statistics.optimise_ms},
            {"warm_start", statistics.warm_start_ms},
            {"certify", statistics.certify_ms}}},
          {"waypoints", std::move(waypoints)}};
}

Json to_json(const std::vector<TimedTransition>& transitions) {
  Json list = Json::array();
  for (const auto& [t_s, record] : transitions) {
    list.push_back({{"t", t_s},
                    {"from", record.from},
                    {"to", record.to},
                    {"event", record.event},
                    {"cause", record.cause}});
  }
  return list;
}

Json to_json(const std::vector<Collision>& collisions) {
  Json list = Json::array();
  for (const auto& [t_s, p_W, obstacle, estimate] : collisions) {
    Json entry = {{"t", t_s},           {"x", p_W.x()},         {"y", p_W.y()},
                  {"z", p_W.z()},       {"obstacle", obstacle}, {"estimated", nullptr},
                  {"error_m", nullptr}, {"sigma_m", nullptr}};
    if (estimate) {
      const Eigen::Vector3d& estimated_W = estimate->p_W;
      entry["estimated"] = {{"x", estimated_W.x()}, {"y", estimated_W.y()}, {"z", estimated_W.z()}};
      entry["error_m"] = estimate->error_m;
      entry["sigma_m"] = estimate->sigma_m;
    }
    list.push_back(std::move(entry));
  }
  return list;
}

Json to_json(const NearestApproach& nearest) {
  if (nearest.obstacle.empty()) return nullptr;
  return {{"t", nearest.t_s},
          {"x", nearest.p_W.x()},
          {"y", nearest.p_W.y()},
          {"z", nearest.p_W.z()},
          {"obstacle", nearest.obstacle}};
}

Json to_json(const DiveResult& result) {
  return {{"outcome", result.outcome},
          {"final_state", result.final_state},
          {"cause", result.cause},
          {"duration_s", result.duration_s},
          {"distance_m", result.distance_m},
          {"min_clearance_m", result.nearest.clearance_m},
          {"nearest", to_json(result.nearest)},
          {"collisions", result.collisions.size()},
          {"collision_list", to_json(result.collisions)},
          {"plans", result.plans},
          {"replans", result.replans},
          {"energy_wh", result.energy_wh},
          {"final_depth_m", result.final_depth_m},
          {"final_error_m", result.final_error_m},
          {"final_sigma_m", result.final_sigma_m},
          {"estimator", result.estimator},
          {"estimator_switches", result.estimator_switches},
          {"transitions", to_json(result.transitions)}};
}

namespace {

Json to_json(const DiveSeries& series) {
  constexpr std::size_t kMaxListed = 5;
  Json worst = Json::array();
  for (std::size_t i = 0; i < std::min(series.worst_first.size(), kMaxListed); ++i) {
    worst.push_back(
        {{"seed", series.worst_first[i].seed}, {"command", series.worst_first[i].command}});
  }
  return {{"dives", series.dives},
          {"first_seed", series.first_seed},
          {"successes", series.successes},
          {"collisions", series.collisions},
          {"surfaced", series.surfaced},
          {"clearance_m",
           {{"min", series.clearance_m.min},
            {"p05", series.clearance_m.p05},
            {"p50", series.clearance_m.p50}}},
          {"collision_bound_95", series.collision_bound_95},
          {"worst", std::move(worst)}};
}

// Expected times of a leg (s since the mission started), and where the current slows it most.
Json times_of(const CheckReport& report, std::size_t leg) {
  Json json = {{"begins_s", nullptr}, {"arrives_s", nullptr}, {"least_progress", nullptr}};
  if (leg >= report.times.legs.size()) return json;
  json["begins_s"] = report.times.legs[leg].begins_s;
  json["arrives_s"] = report.times.legs[leg].arrives_s;
  if (const auto& progress = report.progress[leg]) {
    const Eigen::Vector3d& p_W = progress->place_W;
    json["least_progress"] = {{"over_ground_mps", progress->over_ground},
                              {"share", progress->share},
                              {"crab_deg", rad_to_deg(progress->crab_rad)},
                              {"t", progress->elapsed_s},
                              {"x", p_W.x()},
                              {"y", p_W.y()},
                              {"z", p_W.z()},
                              {"way_back", progress->is_way_back}};
  }
  return json;
}

// The longest exit path from a leg, and when it must begin at the latest.
Json way_out_of(const CheckReport& report, std::size_t leg) {
  if (leg >= report.budget.turning_points.size()) return nullptr;
  const LegExit& exit = report.exit_path.legs[leg];
  const TurningPoint& turn = report.budget.turning_points[leg];
  return {{"length_m", exit.longest_m},
          {"duration_s", exit.longest_s},
          {"overhead", exit.has_overhead},
          {"latest_s", turn.latest_s},
          {"least_battery_fraction", turn.least_charge}};
}

// Without its waypoints.
Json leg_json(const CheckReport& report, std::size_t i) {
  const PlannedRouteLeg& leg = report.legs[i];
  Json plan = mission::to_json(leg.plan, leg.statistics);
  plan.erase("waypoints");
  Json entry = {{"state", leg.state}, {"goal", leg.goal}};
  entry.update(plan);
  entry["margin_sigma"] = nullptr;
  if (std::isfinite(leg.margin.margin_sigma)) {
    const LegMargin& margin = leg.margin;
    entry["margin_sigma"] = margin.margin_sigma;
    entry["margin"] = {{"x", margin.place_W.x()},           {"y", margin.place_W.y()},
                       {"z", margin.place_W.z()},           {"obstacle", margin.obstacle_name},
                       {"clearance_m", margin.clearance_m}, {"sigma_m", margin.sigma_m},
                       {"end_sigma_m", margin.end_sigma_m}};
  }
  entry.update(times_of(report, i));
  entry["way_out"] = way_out_of(report, i);
  return entry;
}

Json fault_json(const FaultResult& result) {
  Json injected = Json::array();
  for (const Fault& fault : result.fault.faults) {
    injected.push_back({{"fault", to_string(fault.kind)}, {"t", fault.at_s}});
  }
  return {{"state", result.fault.state},
          {"injected", std::move(injected)},
          {"safe", result.is_safe()},
          {"surfaced", result.surfaced},
          {"held", result.held},
          {"rest_s", result.dive.rest_s},
          {"final_state", result.dive.final_state},
          {"rung", result.dive.rung},
          {"collisions", result.dive.collisions.size()},
          {"collision_list", to_json(result.dive.collisions)},
          {"min_clearance_m", result.dive.nearest.clearance_m},
          {"duration_s", result.dive.duration_s}};
}

}  // namespace

Json to_json(const CheckReport& report, const Diagnostics& diagnostics) {
  Json plans = Json::array();
  for (std::size_t i = 0; i < report.legs.size(); ++i) plans.push_back(leg_json(report, i));
  Json json = {{"ok", diagnostics.ok()},
               {"diagnostics", to_json(diagnostics)},
               {"budget",
                {{"distance_m", report.budget.distance_m},
                 {"duration_s", report.budget.duration_s},
                 {"energy_wh", report.budget.energy_wh},
                 {"worst_duration_s", report.budget.worst_duration_s},
                 {"worst_energy_wh", report.budget.worst_energy_wh},
                 {"budget_used_under_overhead", report.budget.budget_used_under_overhead}}},
               {"plans", std::move(plans)},
               {"exit_path",
                {{"exists", report.exit_path.exists},
                 {"longest_m", report.exit_path.longest_m},
                 {"longest_s", report.exit_path.longest_s},
                 {"clearance_m", report.exit_path.clearance_m},
                 {"state", report.exit_path.state}}}};
  if (report.dive) json["dive"] = to_json(*report.dive);
  if (report.dives) json["dives"] = to_json(*report.dives);
  if (!report.faults.empty()) {
    Json faults = Json::array();
    for (const FaultResult& result : report.faults) faults.push_back(fault_json(result));
    json["faults"] = std::move(faults);
  }
  return json;
}

Json to_json(const ReplayReport& report) {
  Json divergence = nullptr;
  if (!report.first_divergence.empty()) divergence = report.first_divergence;
  Json difference = nullptr;
  if (!report.mathematics_difference.empty()) difference = report.mathematics_difference;
  return {{"identical", report.identical},
          {"events", report.events},
          {"ticks", report.ticks},
          {"replayed", report.replayed},
          {"torn", report.torn},
          {"gaps", to_json(report.gaps)},
          {"first_divergence", std::move(divergence)},
          {"mathematics",
           {{"log", report.logged_mathematics}, {"replay", report.replayed_mathematics}}},
          {"mathematics_difference", std::move(difference)}};
}

Json to_json(const std::vector<LogGap>& gaps) {
  Json list = Json::array();
  for (const LogGap& gap : gaps) {
    Json to = nullptr;
    if (gap.to) to = to_seconds(*gap.to);
    list.push_back({{"from_s", to_seconds(gap.from)},
                    {"to_s", std::move(to)},
                    {"offset", gap.offset},
                    {"bytes", gap.bytes}});
  }
  return list;
}

void print_rules(const std::vector<std::span<const Rule>>& tables, bool json) {
  Json list = Json::array();
  for (const std::span<const Rule> rules : tables) {
    for (const Rule& rule : rules) {
      if (json) {
        list.push_back({{"code", rule.code},
                        {"severity", to_string(rule.severity)},
                        {"sentence", rule.sentence}});
      } else {
        print(fmt::format("{:<24} {:<8} {}", rule.code, to_string(rule.severity), rule.sentence));
      }
    }
  }
  if (json) print_json({{"rules", std::move(list)}});
}

void print_json(const Json& json) {
  print(json.dump(2, ' ', false, Json::error_handler_t::replace));
}

}  // namespace dive::mission
