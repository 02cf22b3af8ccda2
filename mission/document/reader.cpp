#include "mission/document/reader.h"

#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/document/source_place.h"
#include "mission/document/state_index.h"

namespace dive::mission {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

struct Word {
  std::string text;
  std::size_t offset = 0;
};

std::vector<Word> words_of(std::string_view value) {
  std::vector<Word> words;
  for (std::size_t at = 0; at < value.size();) {
    if (is_blank(value[at])) {
      ++at;
      continue;
    }
    const std::size_t begin = at;
    while (at < value.size() && !is_blank(value[at])) ++at;
    words.push_back({std::string(value.substr(begin, at - begin)), begin});
  }
  return words;
}

class Reader {
 public:
  Reader(const SourceText& source, const Language& language, Diagnostics& diagnostics)
      : source_(source), language_(language), diagnostics_(diagnostics) {}

  Mission read(const XmlElement& root) {
    Mission mission;
    mission.id = name(root, "id").value;
    if (const XmlElement* description = root.child("description")) {
      mission.description = description->text;
    }
    const XmlElement& vehicle = *root.child("vehicle");
    mission.speed = number(vehicle, "speed");
    mission.attitude = attitude_mode(name(vehicle, "attitude").value);
    mission.map_file = path(*root.child("map"), "file");
    const XmlElement& start = *root.child("start");
    mission.start = position(start);
    mission.start_heading_deg = number(start, "heading_deg").value;
    mission.limits = limits(*root.child("limits"));
    mission.replan = replan(root);
    mission.failsafes = failsafes(root);
    const XmlElement& states = *root.child("states");
    mission.initial = name(states, "initial");
    for (const XmlElement& element : states.children) {
      mission.states.push_back(state(element, false));
    }
    return mission;
  }

 private:
  const XmlAttribute& required(const XmlElement& element, std::string_view attribute) {
    const XmlAttribute* found = element.attribute(attribute);
    DIVE_DEMAND(found != nullptr);  // the schema says so, or gives a default
    return *found;
  }

  Located<double> number(const XmlElement& element, std::string_view attribute) {
    const XmlAttribute& written = required(element, attribute);
    const std::optional<double> value = parse_number(written.value);
    DIVE_DEMAND(value);  // every xs:decimal is one of ours
    return {*value, written.value_span};
  }

  std::optional<Located<double>> optional_number(const XmlElement& element,
                                                 std::string_view attribute) {
    if (element.attribute(attribute) == nullptr) return std::nullopt;
    return number(element, attribute);
  }

  Located<std::string> name(const XmlElement& element, std::string_view attribute) {
    return words(required(element, attribute)).front();
  }

  // A path may have blanks inside, but not around it.
  Located<std::string> path(const XmlElement& element, std::string_view attribute) {
    const XmlAttribute& written = required(element, attribute);
    const std::size_t begin = written.value.find_first_not_of(" \t\r\n");
    const std::size_t end = written.value.find_last_not_of(" \t\r\n") + 1;
    return {written.value.substr(begin, end - begin),
            span_in_value(source_, written, begin, end - begin)};
  }

  // The value's words, each with its own place.
  std::vector<Located<std::string>> words(const XmlAttribute& attribute) {
    std::vector<Located<std::string>> located;
    for (Word& word : words_of(attribute.value)) {
      const Span span = span_in_value(source_, attribute, word.offset, word.text.size());
      located.push_back({std::move(word.text), span});
    }
    return located;
  }

  Position position(const XmlElement& element) {
    Position position;
    position.x = number(element, "x");
    position.y = number(element, "y");
    position.z = number(element, "z");
    const std::string units = name(element, "z_units").value;
    position.z_units = units == "DEPTH"      ? ZUnits::kDepth
                       : units == "ALTITUDE" ? ZUnits::kAltitude
                                             : ZUnits::kZ;
    return position;
  }

  Limits limits(const XmlElement& element) {
    return {number(element, "max_depth"), number(element, "min_altitude"),
            number(element, "clearance"), number(element, "mission_timeout"),
            number(element, "battery_reserve")};
  }

  // What an element of that type says when it is not there.
  Located<double> absent(std::string_view type, std::string_view attribute, Span span) const {
    const AttributeRule* rule = language_.type_rule(type).attribute(attribute);
    DIVE_DEMAND(rule != nullptr);
    const std::optional<double> value = parse_number(rule->default_value);
    DIVE_DEMAND(value);
    return {*value, span};
  }

  ReplanPolicy replan(const XmlElement& root) {
    const XmlElement* element = root.child("replan");
    if (element == nullptr) {
      return {std::nullopt, std::nullopt, absent("Replan", "max_replans", root.span)};
    }
    return {optional_number(*element, "period"), optional_number(*element, "deviation"),
            number(*element, "max_replans")};
  }

  Failsafes failsafes(const XmlElement& root) {
    const XmlElement* element = root.child("failsafes");
    const XmlElement& parent = element == nullptr ? root : *element;
    Failsafes failsafes;
    failsafes.leak = failsafe(parent, "leak", 1.0);
    failsafes.overtime = failsafe(parent, "overtime", 0.0);
    failsafes.overdepth = failsafe(parent, "overdepth", 2.0);
    failsafes.planner_failure = failsafe(parent, "planner_failure", 0.0);
    const XmlElement* planner = parent.child("planner_failure");
    failsafes.planner_failures = planner == nullptr
                                     ? absent("PlannerFailsafe", "failures", parent.span)
                                     : number(*planner, "failures");
    return failsafes;
  }

  FailsafeSpec failsafe(const XmlElement& parent, std::string_view kind, double persistence_s) {
    const XmlElement* element = parent.child(kind);
    if (element == nullptr) {
      return {{Rung::kAbortAndSurface, parent.span}, {persistence_s, parent.span}};
    }
    const Located<std::string> rung = name(*element, "rung");
    FailsafeSpec spec{{Rung::kAbortAndSurface, rung.span}, {persistence_s, element->span}};
    if (rung.value == to_string(Rung::kWarn)) spec.rung.value = Rung::kWarn;
    if (rung.value == to_string(Rung::kEmergencySurface)) {
      spec.rung.value = Rung::kEmergencySurface;
    }
    if (const auto written = optional_number(*element, "persistence")) {
      spec.persistence_s = *written;
    }
    return spec;
  }

  StateSpec state(const XmlElement& element, bool overhead_above) {
    StateSpec spec;
    spec.id = name(element, "id");
    const XmlAttribute* overhead = element.attribute("overhead");
    spec.overhead =
        overhead_above || (overhead != nullptr && words(*overhead).front().value == "true");
    set_type_and_leaf(element, spec);
    for (const XmlElement& child : element.children) {
      if (child.name == "transition") {
        spec.transitions.push_back(transition(child));
      } else if (child.name != "goal") {
        spec.children.push_back(state(child, spec.overhead));
      }
    }
    // A state with nothing inside is a leaf that watches and steers nothing.
    if (spec.type == StateType::kCompound && spec.children.empty()) spec.type = StateType::kLeaf;
    if (element.attribute("initial") != nullptr) {
      spec.initial = name(element, "initial");
    } else if (spec.type == StateType::kCompound) {
      spec.initial = first_inside(spec);
    }
    return spec;
  }

  static std::optional<Located<std::string>> first_inside(const StateSpec& spec) {
    for (const StateSpec& child : spec.children) {
      if (!is_history(child)) return Located<std::string>{child.id.value, spec.id.span};
    }
    return std::nullopt;
  }

  void set_type_and_leaf(const XmlElement& element, StateSpec& spec) {
    if (element.name == "goto") {
      spec.leaf = GotoState{goal(element), *timeout(element)};
    } else if (element.name == "goal_sequence") {
      GoalSequenceState sequence{{}, *timeout(element)};
      for (const XmlElement& child : element.children) {
        if (child.name == "goal") sequence.goals.push_back(goal(child));
      }
      spec.leaf = std::move(sequence);
    } else if (element.name == "hold") {
      spec.leaf = HoldState{number(element, "duration")};
    } else if (element.name == "surface") {
      spec.leaf = SurfaceState{timeout(element)};
    } else if (element.name == "history") {
      spec.type = name(element, "type").value == "deep" ? StateType::kDeepHistory
                                                        : StateType::kShallowHistory;
    } else {
      spec.type = element.name == "final"      ? StateType::kFinal
                  : element.name == "parallel" ? StateType::kParallel
                                               : StateType::kCompound;
    }
  }

  Goal goal(const XmlElement& element) {
    Goal goal;
    goal.id = name(element, "id");
    goal.position = position(element);
    goal.heading_deg = optional_number(element, "heading_deg");
    goal.capture_radius = number(element, "capture_radius");
    goal.dwell_s = optional_number(element, "dwell").value_or(Located<double>{0.0, element.span});
    goal.span = element.span;
    return goal;
  }

  std::optional<Timeout> timeout(const XmlElement& element) {
    const auto seconds = optional_number(element, "timeout");
    if (!seconds) {
      if (const XmlAttribute* alone = element.attribute("on_timeout")) {
        diagnostics_.error("MIS-TIMEOUT", source_, alone->name_span,
                           fmt::format("'{}' has an on_timeout but no timeout", element.name));
      }
      return std::nullopt;
    }
    Timeout timeout{*seconds, {{}, seconds->span}};  // rules.h reports an on_timeout left out
    if (element.attribute("on_timeout") != nullptr)
      timeout.on_timeout = name(element, "on_timeout");
    return timeout;
  }

  TransitionSpec transition(const XmlElement& element) {
    TransitionSpec spec;
    spec.span = element.span;
    spec.internal = name(element, "type").value == "internal";
    if (const XmlAttribute* event = element.attribute("event")) {
      for (Located<std::string>& word : words(*event)) {
        spec.events.push_back(std::move(word.value));
        spec.event_spans.push_back(word.span);
      }
    }
    if (const XmlAttribute* target = element.attribute("target")) spec.targets = words(*target);
    if (const XmlAttribute* cond = element.attribute("cond")) spec.guard = guard(*cond);
    return spec;
  }

  std::optional<Guard> guard(const XmlAttribute& cond) {
    Guard::Error error;
    std::optional<Guard> guard = Guard::parse(cond.value, error);
    if (!guard) {
      diagnostics_.error("MIS-COND", source_, span_in_value(source_, cond, error.offset, 1),
                         error.message, error.hint);
    }
    return guard;
  }

  const SourceText& source_;
  const Language& language_;
  Diagnostics& diagnostics_;
};

}  // namespace

Mission read_mission(XmlDocument document, const Language& language, Diagnostics& diagnostics) {
  language.add_defaults(document.root);
  Mission mission = Reader(document.source, language, diagnostics).read(document.root);
  mission.source = std::move(document.source);
  return mission;
}

}  // namespace dive::mission
