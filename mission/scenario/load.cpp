#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/operator_command.h"
#include "mission/document/attribute_reader.h"
#include "mission/document/language.h"
#include "mission/document/schema.h"
#include "mission/scenario/scenario.h"

namespace dive::mission {

extern const char kScenarioXsd[];

namespace {

constexpr XmlLimits kLimits{
    .max_bytes = 256U << 10U, .max_depth = 8, .max_elements = 5000, .max_attributes = 32};

constexpr SchemaSource kSchema{"scenario.xsd", kScenarioXsd, "scenario", "urn:dive:scenario:1"};

struct WrittenExpectation {
  std::string_view element;
  Expectation::Kind kind;
  /// Attribute that names what is expected; empty: the element alone does.
  std::string_view attribute;
};

using Kind = Expectation::Kind;

constexpr WrittenExpectation kExpectations[] = {
    {"outcome", Kind::kOutcome, "is"},
    {"final_state", Kind::kFinalState, "is"},
    {"enters", Kind::kEnters, "state"},
    {"event", Kind::kEvent, "name"},
    {"rung", Kind::kRung, "is"},
    {"replan", Kind::kReplan, "cause"},
    {"payload", Kind::kPayload, "command"},
    {"line", Kind::kLine, "contains"},
    {"heads_for", Kind::kHeadsFor, "goal"},
    {"reaches", Kind::kReaches, "goal"},
    {"ends_near", Kind::kEndsNear, ""},
};

// Text with every run of blanks and line breaks replaced by one blank.
std::string in_one_line(const std::string& text) {
  std::istringstream words(text);
  std::string line;
  for (std::string word; words >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

class Reader {
 public:
  Reader(const SourceText& source, Diagnostics& diagnostics)
      : source_(source), read_(source), diagnostics_(diagnostics) {}

  void read(const XmlElement& root, Scenario& scenario) {
    scenario.id = read_.name(root, "id").value;
    scenario.mission_file = read_.path(root, "mission");
    scenario.seed = static_cast<std::uint64_t>(read_.number(root, "seed").value);
    if (const auto rest = read_.optional_number(root, "rest")) scenario.rest_s = rest->value;
    find_mission(scenario);
    for (const XmlElement& part : root.children) {
      if (part.name == "description") scenario.description = in_one_line(part.text);
      if (part.name == "set") set(part, scenario);
      if (part.name == "cameras") {
        scenario.camera_scale = read_.number(part, "scale").value;
        scenario.camera_hz = read_.number(part, "rate").value;
      }
      if (part.name == "diver") diver(part, scenario);
      if (part.name == "at") scenario.steps.push_back(step(part));
      if (part.name != "expect") continue;
      for (const XmlElement& child : part.children) {
        scenario.expectations.push_back(expectation(child));
      }
    }
    if (scenario.expectations.empty()) {
      error("SCN-EXPECT", root.span, "the scenario has no expectations",
            "add one, such as <expect><outcome is=\"success\"/></expect>");
    }
    add_unsaid(root, scenario);
  }

 private:
  void error(const char* code, Span span, std::string message, std::string hint = {}) {
    diagnostics_.error(code, source_, span, std::move(message), std::move(hint));
  }

  void find_mission(Scenario& scenario) {
    const std::filesystem::path written = scenario.mission_file.value;
    if (written.is_absolute()) {
      error("SCN-MISSION-PATH", scenario.mission_file.span,
            "the path of the mission is absolute, but must be relative to the scenario",
            "so that both can be moved together");
    }
    const std::filesystem::path folder = std::filesystem::path(source_.path()).parent_path();
    scenario.mission_path = (folder / written).lexically_normal().string();
  }

  void set(const XmlElement& element, Scenario& scenario) {
    const Located<double> value = read_.number(element, "value");
    scenario.conditions.emplace_back(read_.name(element, "condition").value, value.value);
    vehicle::Conditions conditions;
    const auto& [name, number] = scenario.conditions.back();
    DIVE_DEMAND(conditions.set(name, number));  // the schema lists all names
    const std::string problem = conditions.validate();
    if (!problem.empty()) error("SCN-CONDITION", value.span, problem);
  }

  void diver(const XmlElement& element, Scenario& scenario) {
    if (scenario.diver) error("SCN-DIVER", element.span, "the scenario has a second diver");
    vehicle::DiverTrack track;
    track.start_s = read_.number(element, "start").value;
    track.speed = read_.number(element, "speed").value;
    track.keeps_m = read_.number(element, "keeps").value;
    for (const XmlElement& waypoint : element.children) {
      const auto number = [&](const char* name) { return read_.number(waypoint, name).value; };
      track.waypoints.push_back({{number("x"), number("y"), -number("depth")}, number("pause")});
    }
    const std::string problem = track.validate();
    if (!problem.empty()) error("SCN-DIVER", element.span, problem);
    scenario.diver = std::move(track);
  }

  ScriptStep step(const XmlElement& element) {
    ScriptStep step;
    step.span = element.span;
    if (element.attribute("id") != nullptr) step.id = read_.name(element, "id");
    step.trigger = trigger(element);
    for (const XmlElement& child : element.children) step.actions.push_back(action(child));
    return step;
  }

  Trigger trigger(const XmlElement& element) {
    constexpr std::pair<const char*, Trigger::Kind> kWhen[] = {{"time", Trigger::Kind::kTime},
                                                               {"state", Trigger::Kind::kState},
                                                               {"event", Trigger::Kind::kEvent},
                                                               {"goal", Trigger::Kind::kGoal}};
    Trigger trigger;
    trigger.after_s = read_.number(element, "after").value;
    int written = 0;
    for (const auto& [attribute, kind] : kWhen) {
      if (element.attribute(attribute) == nullptr) continue;
      ++written;
      trigger.kind = kind;
      if (kind == Trigger::Kind::kTime) {
        trigger.after_s += read_.number(element, attribute).value;
      } else {
        trigger.name = read_.name(element, attribute);
      }
    }
    if (written != 1) {
      error("SCN-WHEN", element.span,
            written == 0 ? "'at' has no trigger" : "'at' has more than one trigger",
            "write one of time, state, event and goal");
    }
    return trigger;
  }

  double until(const XmlElement& element) const {
    const auto seconds = read_.optional_number(element, "for");
    return seconds ? seconds->value : std::numeric_limits<double>::infinity();
  }

  ScriptAction action(const XmlElement& element) {
    const auto number = [&](const char* name) { return read_.number(element, name).value; };
    const auto word = [&](const char* name) { return read_.name(element, name).value; };
    if (element.name == "fault") {
      const std::optional<FaultKind> kind = find_fault(word("name"));
      DIVE_DEMAND(kind);  // the schema lists all values
      return FailAction{*kind, until(element)};
    }
    if (element.name == "loss") {
      const std::optional<SampleStream> of = find_sample_stream(word("of"));
      DIVE_DEMAND(of);  // the schema lists all values
      return LossAction{*of, number("share"), until(element)};
    }
    if (element.name == "operator") {
      const std::optional<OperatorCommand> command = find_operator_command(word("command"));
      DIVE_DEMAND(command);  // the schema lists all values
      return OperatorAction{*command};
    }
    if (element.name == "heartbeat") return HeartbeatAction{number("every"), until(element)};
    if (element.name == "current") return CurrentAction{{number("x"), number("y"), number("z")}};
    return obstacle(element);
  }

  ObstacleAction obstacle(const XmlElement& element) {
    const auto number = [&](const char* name) { return read_.number(element, name).value; };
    ObstacleAction action;
    action.obstacle.size = {number("east"), number("north"), number("height")};
    action.obstacle.is_observed = read_.flag(element, "observed");
    if (const auto ahead = read_.optional_number(element, "ahead")) action.ahead_m = ahead->value;
    int coordinates = 0;
    for (const char* name : {"x", "y", "depth"}) {
      coordinates += element.attribute(name) != nullptr ? 1 : 0;
    }
    if (coordinates != (action.ahead_m ? 0 : 3)) {
      error("SCN-OBSTACLE", element.span,
            action.ahead_m ? "the obstacle has two places" : "the obstacle has no complete place",
            "write x, y and depth, or ahead");
    } else if (!action.ahead_m) {
      action.obstacle.X_WO.p = {number("x"), number("y"), -number("depth")};
    }
    return action;
  }

  Expectation expectation(const XmlElement& element) {
    Expectation expectation;
    expectation.span = element.span;
    expectation.negated = read_.flag(element, "not");
    expectation.kind = Kind::kBounds;
    expectation.name = {element.name, element.span};
    for (const WrittenExpectation& known : kExpectations) {
      if (known.element != element.name) continue;
      expectation.kind = known.kind;
      if (!known.attribute.empty()) expectation.name = what(element, known);
    }
    if (expectation.kind == Kind::kRung && element.attribute("cause") != nullptr) {
      expectation.cause = read_.name(element, "cause").value;
    }
    if (element.attribute("radius") != nullptr) {
      expectation.radius_m = read_.number(element, "radius").value;
    }
    if (expectation.kind == Kind::kEndsNear) {
      expectation.place_W = {read_.number(element, "x").value, read_.number(element, "y").value,
                             0.0};
    }
    read_when(element, expectation);
    read_bounds(element, expectation);
    return expectation;
  }

  [[nodiscard]] Located<std::string> what(const XmlElement& element,
                                          const WrittenExpectation& known) const {
    return known.kind == Kind::kLine ? read_.text(element, known.attribute)
                                     : read_.name(element, known.attribute);
  }

  void read_when(const XmlElement& element, Expectation& expectation) {
    if (element.attribute("after") != nullptr) expectation.after = read_.name(element, "after");
    expectation.within_s = read_.optional_number(element, "within");
    if (const auto times = read_.optional_number(element, "times")) {
      expectation.times = static_cast<int>(times->value);
    }
  }

  void read_bounds(const XmlElement& element, Expectation& expectation) {
    if (expectation.kind != Kind::kBounds) return;
    expectation.at_least = read_.optional_number(element, "at_least");
    expectation.at_most = read_.optional_number(element, "at_most");
    if (!expectation.at_least && !expectation.at_most) {
      error("SCN-BOUNDS", element.span, fmt::format("'{}' has no bound", element.name),
            "write at_least, at_most or both");
    } else if (expectation.at_least && expectation.at_most &&
               expectation.at_least->value > expectation.at_most->value) {
      error("SCN-BOUNDS", expectation.at_most->span, "at_most is less than at_least");
    }
  }

  // Adds the implicit expectations: no collision, unless collisions are mentioned, and execution of
  // the whole script.
  static void add_unsaid(const XmlElement& root, Scenario& scenario) {
    const bool spoken_of =
        std::ranges::any_of(scenario.expectations, [](const Expectation& expectation) {
          return expectation.kind == Kind::kBounds && expectation.name.value == "collisions";
        });
    if (!spoken_of) {
      Expectation unharmed;
      unharmed.kind = Kind::kBounds;
      unharmed.name = {"collisions", root.span};
      unharmed.at_most = Located<double>{0.0, root.span};
      unharmed.span = root.span;
      scenario.expectations.push_back(unharmed);
    }
    for (std::size_t i = 0; i < scenario.steps.size(); ++i) {
      Expectation happens;
      happens.kind = Kind::kStepHappens;
      happens.step = static_cast<int>(i);
      happens.span = scenario.steps[i].span;
      scenario.expectations.push_back(happens);
    }
  }

  const SourceText& source_;
  AttributeReader read_;
  Diagnostics& diagnostics_;
};

std::optional<Scenario> from_document(std::optional<XmlDocument> document,
                                      Diagnostics& diagnostics) {
  const Language language(kSchema);
  if (!document || !check_schema(*document, language, diagnostics)) {
    diagnostics.sort();
    return std::nullopt;
  }
  language.add_defaults(document->root);
  const std::size_t errors_before = diagnostics.error_count();
  Scenario scenario;
  Reader(document->source, diagnostics).read(document->root, scenario);
  scenario.source = std::move(document->source);
  diagnostics.sort();
  if (diagnostics.error_count() != errors_before) return std::nullopt;
  return scenario;
}

}  // namespace

std::optional<SampleStream> find_sample_stream(std::string_view name) {
  const auto found = std::ranges::find(kSampleStreamNames, name);
  if (found == kSampleStreamNames.end()) return std::nullopt;
  return static_cast<SampleStream>(found - kSampleStreamNames.begin());
}

std::optional<Scenario> load_scenario(const std::string& path, Diagnostics& diagnostics) {
  return from_document(read_xml(path, kLimits, diagnostics), diagnostics);
}

std::optional<Scenario> parse_scenario(SourceText source, Diagnostics& diagnostics) {
  return from_document(parse_xml(std::move(source), kLimits, diagnostics), diagnostics);
}

}  // namespace dive::mission
