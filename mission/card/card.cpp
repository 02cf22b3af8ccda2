#include "mission/card/card.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/card/abort_table.h"
#include "mission/card/card_legs.h"
#include "mission/card/card_size.h"
#include "mission/card/card_text.h"
#include "mission/card/checklist.h"
#include "mission/report/html.h"
#include "mission/report/sha256.h"

namespace dive::mission {

// Embedded from mission/card/page/: CMakeLists.txt.
extern const char kCardPage[];
extern const char kCardStyle[];

namespace {

std::string cell(std::string_view text, const char* of_class = "") {
  return fmt::format("<td{}>{}</td>", of_class, escaped_html(text));
}

constexpr const char* kNumber = " class=\"n\"";
constexpr const char* kTurn = " class=\"n turn\"";

std::string limit(std::string_view name, const std::string& value) {
  return fmt::format("<div>{}<b>{}</b></div>", name, value);
}

std::string limits(const CardSource& source) {
  const Mission& mission = source.mission;
  const Limits& limits = mission.limits;
  const Budget& budget = source.report.budget;
  std::string html = "<div class=\"limits\">";
  html += limit("Depth at most", fmt::format("{:g} m", limits.max_depth.value));
  html += limit("Ground at least", fmt::format("{:g} m", limits.min_altitude.value));
  html += limit("Clearance", fmt::format("{:g} m", limits.clearance.value));
  html += limit("Speed", fmt::format("{:g} m/s", mission.speed.value));
  html += limit("Time limit", clock_text(limits.mission_timeout.value));
  html += limit("Expected", clock_text(budget.duration_s));
  html += limit("Reserve", fmt::format("{:.0f} %", 100.0 * limits.battery_reserve.value));
  html += limit("Route", fmt::format("{:.0f} m", budget.distance_m));
  return html + "</div>";
}

std::string numbers_of(const CardLeg& leg) {
  return leg.first == leg.last ? fmt::format("{}", leg.first)
                               : fmt::format("{}-{}", leg.first, leg.last);
}

std::string name_of(const CardLeg& leg) {
  if (leg.first != leg.last) return leg.from + " \u2026 " + leg.to;
  return leg.state == leg.to ? leg.to : fmt::format("{} ({})", leg.to, leg.state);
}

std::string exit_path_of(const LegExit& exit) {
  if (!exit.has_overhead) return fmt::format("up {}", clock_text(exit.longest_s));
  return fmt::format("back {:.0f} m, {}", std::ceil(exit.longest_m), clock_text(exit.longest_s));
}

// Without a simulated world the paths in an unknown environment are not certified.
std::string clearance_of(const CardLeg& leg, const Mission& mission) {
  if (!has_simulation_map(mission)) return "\u2013";
  return is_cut_off(leg.clearance_m) ? fmt::format("\u2265 {:g} m", leg.clearance_m)
                                     : fmt::format("{:.2f} m", leg.clearance_m);
}

std::string leg_row(const CardLeg& leg, const Mission& mission) {
  const std::string margin =
      std::isfinite(leg.margin_sigma) ? fmt::format("{:.1f} \u03c3", leg.margin_sigma) : "\u2013";
  std::string row = "<tr>" + cell(numbers_of(leg)) + cell(name_of(leg));
  row += cell(fmt::format("{:.0f} m", leg.length_m), kNumber);
  row += cell(fmt::format("{:.1f} m", leg.max_depth_m), kNumber);
  row += cell(clock_text(leg.arrives_s), kNumber);
  row += cell(clearance_of(leg, mission), kNumber) + cell(margin, kNumber);
  row += cell(exit_path_of(leg.exit), kNumber);
  row += cell(clock_text(leg.turn.latest_s), kTurn);
  row += cell(fmt::format("{:.0f} %", std::ceil(100.0 * leg.turn.least_charge)), kTurn);
  return row + "</tr>";
}

std::string thirds_of(const Budget& budget) {
  if (budget.budget_used_under_overhead <= 0.0) return "";
  return fmt::format(
      " Under the overhead {:.0f} % of the usable time or charge is used when the "
      "return begins (in <b>{}</b>).",
      100.0 * budget.budget_used_under_overhead,
      escaped_html(cut_text(budget.worst_overhead_state, kMaxNameBytes)));
}

std::string legs(const CardSource& source) {
  std::string html =
      "<table class=\"one\"><colgroup><col style=\"width:6%\"><col><col style=\"width:8%\">"
      "<col style=\"width:9%\"><col style=\"width:8%\"><col style=\"width:9%\">"
      "<col style=\"width:9%\"><col style=\"width:17%\"><col style=\"width:9%\">"
      "<col style=\"width:7%\"></colgroup>"
      "<tr><th>Leg</th><th>to</th><th class=\"n\">Length</th><th class=\"n\">Depth</th>"
      "<th class=\"n\">Arrives</th><th class=\"n\">Clearance</th>"
      "<th class=\"n\">Margin</th><th class=\"n\">Exit path</th><th class=\"n\">TURN BY</th>"
      "<th class=\"n\">or at</th></tr>";
  for (const CardLeg& leg : card_legs(source.report)) html += leg_row(leg, source.mission);
  html +=
      "</table><p>No return after <b>TURN BY</b> or below that charge: the longest exit "
      "path from the leg then no longer fits the limits.";
  return html + thirds_of(source.report.budget) + "</p>";
}

bool has_overhead(const CheckReport& report) {
  return std::ranges::any_of(report.exit_path.legs, &LegExit::has_overhead);
}

// The states with a leg of which `has` holds.
std::string states_with(const CheckReport& report, bool LegExit::*has) {
  std::vector<std::string> states;
  for (std::size_t i = 0; i < report.legs.size(); ++i) {
    const std::string name = cut_text(report.legs[i].state, kMaxNameBytes);
    if (!(report.exit_path.legs[i].*has)) continue;
    if (std::ranges::find(states, name) == states.end()) states.push_back(name);
  }
  constexpr std::size_t kShown = 4;
  return escaped_html(list_text(states, kShown));
}

std::string aborts(const CardSource& source) {
  const bool with_overhead = has_overhead(source.report);
  std::string html =
      fmt::format("<table class=\"faults\"><tr><th>Fault</th><th>{}{}</th>",
                  with_overhead ? "in open water: " : "the vehicle",
                  with_overhead ? states_with(source.report, &LegExit::has_open_water) : "");
  if (with_overhead) {
    html += fmt::format("<th>under an overhead: {}</th>",
                        states_with(source.report, &LegExit::has_overhead));
  }
  html += "</tr>";
  for (const AbortRow& row : abort_table(source.mission)) {
    html += "<tr>" + cell(fmt::format("{}", fmt::join(row.faults, "; "))) + cell(row.in_open_water);
    if (with_overhead) html += cell(row.under_overhead);
    html += "</tr>";
  }
  return html + "</table>";
}

std::string reactions(const CardSource& source) {
  const std::vector<StateReaction> all = state_reactions(source.mission, source.report);
  if (all.empty()) return "";
  std::string html =
      "<table class=\"one\"><colgroup><col style=\"width:18%\"><col style=\"width:20%\">"
      "<col style=\"width:20%\"><col></colgroup><tr><th>State</th><th>takes longer than</th>"
      "<th>finds no path</th><th>otherwise</th></tr>";
  for (std::size_t i = 0; i < std::min(all.size(), kMaxReactionRows); ++i) {
    const StateReaction& reaction = all[i];
    html += "<tr>" + cell(reaction.state) + cell(reaction.at_timeout);
    html += cell(reaction.without_path) + cell(reaction.otherwise) + "</tr>";
  }
  html += "</table>";
  if (all.size() <= kMaxReactionRows) return html;
  return html +
         fmt::format("<p>and {} more states: see the mission</p>", all.size() - kMaxReactionRows);
}

std::string faults_of(const std::vector<FaultResult>& faults) {
  if (faults.empty()) return "Faults were not dived (<b>dive check --faults</b>).";
  const auto held = std::ranges::count_if(faults, &FaultResult::held);
  double longest_s = 0.0;
  for (const FaultResult& result : faults) {
    if (!result.surfaced) continue;
    longest_s = std::max(longest_s, result.dive.duration_s - result.fault.faults.front().at_s);
  }
  return fmt::format(
      "<b>{}</b> dives with faults in every state: all safe, <b>{}</b> of them held "
      "in place; at the surface within <b>{}</b> of the fault.",
      faults.size(), held, clock_text(longest_s));
}

std::string dives(const CheckReport& report) {
  if (!report.dives) return "<p><b>None.</b> Only plans and budgets were checked.</p>";
  const DiveSeries& series = *report.dives;
  return fmt::format(
      "<p><b>{} of {}</b> dives collided: at most <b>{:.1f} %</b> of dives do (95 % confidence). "
      "<b>{}</b> ended as planned, <b>{}</b> at the surface. Clearance <b>{:.2f} m</b> (5th "
      "percentile), {:.2f} m (least). {}</p>",
      series.collisions, series.dives, 100.0 * series.collision_bound_95, series.successes,
      series.surfaced, series.clearance_m.p05, series.clearance_m.min, faults_of(report.faults));
}

std::string warnings(const Diagnostics& diagnostics) {
  std::string html;
  std::size_t count = 0;
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    if (diagnostic.severity != Severity::kWarning || ++count > kMaxCardWarnings) continue;
    html += fmt::format("<p><b>{}</b> {}</p>", diagnostic.code,
                        escaped_html(cut_text(diagnostic.message, kMaxWarningBytes)));
  }
  if (count == 0) return "";
  if (count > kMaxCardWarnings) {
    html += fmt::format("<p>and {} more warnings of dive check</p>", count - kMaxCardWarnings);
  }
  return "<div class=\"warnings\">" + html + "</div>";
}

std::string ticked(const CardSource& source) {
  std::string html = "<ul>";
  for (const std::string& line : checklist(source.mission, source.report)) {
    html += "<li>" + escaped_html(line) + "</li>";
  }
  return html + "</ul>";
}

std::string file(const char* role, const std::string& name, std::string_view content) {
  return fmt::format("<div><span>{} {}</span><code>{}</code></div>", role,
                     escaped_html(cut_text(name, kMaxNameBytes)), sha256(content));
}

// Hashes as `sha256sum` prints them, of the files as used: those of included files are expanded.
std::string files(const CardSource& source) {
  const std::filesystem::path path = source.mission.source.path();
  std::string html = file("mission", path.filename().string(), source.mission.source.content());
  if (!source.map.empty()) html += file("map", source.mission.map_file.value, source.map);
  html += file("vehicle", "", source.vehicle);
  return html + fmt::format("<div><span>SHA-256 of the files as used; dive {}</span></div>",
                            escaped_html(source.version));
}

std::string style(const CardSource& source) {
  return fmt::format("<style>\n{}body {{ font-size: {:.1f}pt; }}\n</style>", kCardStyle,
                     type_size(source));
}

std::string text_for(std::string_view name, const CardSource& source) {
  const Mission& mission = source.mission;
  if (name == "id") return escaped_html(cut_text(mission.id, kMaxNameBytes));
  if (name == "description") {
    return escaped_html(cut_text(mission.description, kMaxDescriptionBytes));
  }
  if (name == "style") return style(source);
  if (name == "warnings") return warnings(source.diagnostics);
  if (name == "limits") return limits(source);
  if (name == "legs") return legs(source);
  if (name == "aborts") return aborts(source);
  if (name == "reactions") return reactions(source);
  if (name == "dives") return dives(source.report);
  if (name == "checklist") return ticked(source);
  DIVE_DEMAND(name == "files");
  return files(source);
}

}  // namespace

std::string render_card(const CardSource& source) {
  DIVE_DEMAND(source.diagnostics.ok());
  return filled_page(kCardPage, [&](std::string_view name) { return text_for(name, source); });
}

}  // namespace dive::mission
