// Kinds of mission that are written in one element and made of several goals or states.

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/se3.h"
#include "mission/document/state_reader.h"

namespace dive::mission {
namespace {

constexpr double kGroundStep = 5.0;  // m between the goals of a leg that follows the ground

using Eigen::Vector2d;

struct Line {
  Vector2d from;
  Vector2d to;
  Span span;
};

Vector2d point(const AttributeReader& attributes, const XmlElement& element, const char* x,
               const char* y) {
  return {attributes.number(element, x).value, attributes.number(element, y).value};
}

// Every second row is swum the other way round.
void add_rows(const AttributeReader& attributes, const XmlElement& rows, std::vector<Line>& lines) {
  const double yaw = heading_to_yaw(attributes.number(rows, "heading_deg").value);
  const Vector2d along(std::cos(yaw), std::sin(yaw));
  const bool to_the_left = attributes.name(rows, "side").value == "left";
  const Vector2d left(-along.y(), along.x());
  const Vector2d across = (to_the_left ? 1.0 : -1.0) * left;
  const Vector2d begin = point(attributes, rows, "x", "y");
  const double length = attributes.number(rows, "length").value;
  const double spacing = attributes.number(rows, "spacing").value;
  const int count = static_cast<int>(attributes.number(rows, "count").value);
  for (int row = 0; row < count; ++row) {
    const Vector2d near = begin + row * spacing * across;
    const Vector2d far = near + length * along;
    lines.push_back(row % 2 == 0 ? Line{near, far, rows.span} : Line{far, near, rows.span});
  }
}

std::vector<Line> lines_of(const AttributeReader& attributes, const XmlElement& transect) {
  std::vector<Line> lines;
  for (const XmlElement& child : transect.children) {
    if (child.name == "leg") {
      lines.push_back({point(attributes, child, "from_x", "from_y"),
                       point(attributes, child, "to_x", "to_y"), child.span});
    } else if (child.name == "rows") {
      add_rows(attributes, child, lines);
    }
  }
  return lines;
}

TransitionSpec leads(std::vector<std::string> events, std::string target, Span span) {
  TransitionSpec spec;
  spec.span = span;
  spec.event_spans.assign(events.size(), span);
  spec.events = std::move(events);
  if (!target.empty()) spec.targets = {{std::move(target), span}};
  return spec;
}

}  // namespace

// A leg at an altitude is divided, so that it follows the ground; at a depth its ends are enough.
GoalSequenceState StateReader::transect(const XmlElement& element) const {
  const Located<double> z = attributes_.number(element, "z");
  const ZUnits units = attributes_.z_units(element);
  const Located<std::string> id = attributes_.name(element, "id");
  GoalSequenceState sequence;
  const auto add = [&](const Vector2d& p, Span span) {
    Goal goal;
    goal.id = {fmt::format("{}-{}", id.value, sequence.goals.size() + 1), span};
    goal.position = {{p.x(), span}, {p.y(), span}, z, units};
    goal.capture_radius = attributes_.number(element, "capture_radius");
    goal.dwell_s = {0.0, span};
    goal.span = span;
    sequence.goals.push_back(std::move(goal));
  };
  for (const Line& line : lines_of(attributes_, element)) {
    const double length = (line.to - line.from).norm();
    const int pieces =
        units == ZUnits::kAltitude ? std::max(1, static_cast<int>(length / kGroundStep)) : 1;
    for (int i = 0; i <= pieces; ++i) {
      add(line.from + static_cast<double>(i) / pieces * (line.to - line.from), line.span);
    }
  }
  return sequence;
}

//   ID            compound, timeout
//     ID-entry    goto, in open water
//     ID-inside   goal_sequence; leaves for ID-exit when done, failed, far enough or spent enough
//     ID-exit     goto; when no path is found, ID-retrace
//     ID-retrace  retrace
//     ID-out      final
StateSpec StateReader::penetration(const XmlElement& element) {
  const Located<std::string> id = attributes_.name(element, "id");
  const auto part = [&id](const char* name) { return fmt::format("{}-{}", id.value, name); };
  const XmlElement& entry = *element.child("entry");
  const XmlElement* exit = element.child("exit");
  const Span span = element.span;

  StateSpec whole;
  whole.element = element.name;
  whole.id = id;
  whole.type = StateType::kCompound;
  whole.initial = {part("entry"), id.span};
  read_content(element, whole);
  const std::optional<ReplanPolicy> replan = std::exchange(whole.replan, std::nullopt);

  StateSpec in =
      penetration_part(element, "entry", GotoState{penetration_waypoint(element, entry, "entry")});
  in.overhead = false;
  in.transitions = {leads({"done.state." + in.id.value}, part("inside"), span),
                    leads({"plan.failed." + in.id.value}, {}, span)};
  // To the outside it is the penetration that cannot be begun.
  in.transitions.back().actions = {
      {ActionSpec::Kind::kRaise, {"plan.failed." + id.value, span}, false}};

  GoalSequenceState goals;
  for (const XmlElement& child : element.children) {
    if (child.name == "goal") goals.goals.push_back(goal(child));
  }
  StateSpec inside = penetration_part(element, "inside", std::move(goals));
  inside.transitions = {leads({"done.state." + inside.id.value, "plan.failed." + inside.id.value},
                              part("exit"), span),
                        turn_back(element)};

  StateSpec out = penetration_part(
      element, "exit",
      GotoState{penetration_waypoint(element, exit != nullptr ? *exit : entry, "exit")});
  out.transitions = {leads({"done.state." + out.id.value}, part("out"), span),
                     leads({"plan.failed." + out.id.value}, part("retrace"), span)};

  StateSpec back = penetration_part(element, "retrace", RetraceState{});
  back.transitions = {leads({"done.state." + back.id.value}, part("out"), span)};

  StateSpec end = penetration_part(element, "out", std::monostate{});
  end.type = StateType::kFinal;
  end.overhead = false;

  for (StateSpec* planning : {&in, &inside, &out}) planning->replan = replan;
  whole.children = {std::move(in), std::move(inside), std::move(out), std::move(back),
                    std::move(end)};
  return whole;
}

StateSpec StateReader::penetration_part(const XmlElement& element, const char* part,
                                        Leaf leaf) const {
  const Located<std::string> id = attributes_.name(element, "id");
  StateSpec spec;
  spec.element = element.name;
  spec.id = {fmt::format("{}-{}", id.value, part), id.span};
  spec.leaf = std::move(leaf);
  spec.overhead = true;
  return spec;
}

Goal StateReader::penetration_waypoint(const XmlElement& element, const XmlElement& waypoint,
                                       const char* part) const {
  Goal result = goal(waypoint);
  result.id = {fmt::format("{}-{}", attributes_.name(element, "id").value, part), waypoint.span};
  return result;
}

TransitionSpec StateReader::turn_back(const XmlElement& element) const {
  TransitionSpec spec =
      leads({}, fmt::format("{}-exit", attributes_.name(element, "id").value), element.span);
  const std::string cond = fmt::format("penetration > {} m or spent > {}",
                                       attributes_.number(element, "max_penetration").value,
                                       attributes_.number(element, "turn_back").value);
  Guard::Error error;
  spec.guard = Guard::parse(cond, error);
  DIVE_DEMAND(spec.guard);
  return spec;
}

}  // namespace dive::mission
