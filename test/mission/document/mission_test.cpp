// The reader returns the values as written, with their positions.

#include "mission/document/mission.h"

#include <filesystem>
#include <string>
#include <tuple>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "mission/document/state_index.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

using behaviors::FailsafeKind;

double threshold(const Failsafes& failsafes, FailsafeKind kind) {
  return failsafes.threshold[static_cast<std::size_t>(kind)];
}

const std::string kWindow = DIVE_SOURCE_DIR "/missions/window.xml";

std::string rendered(const Diagnostics& diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics.list()) text += render(diagnostic, false);
  return text;
}

// The text that a span underlines.
std::string at(const SourceText& source, const Span& span) {
  return std::string(source.line(span.line))
      .substr(static_cast<std::size_t>(span.column - 1), static_cast<std::size_t>(span.length));
}

// A mission of a single goto; `attributes` are the goto's, `parts` precede the states.
std::string mission_text(const std::string& attributes, const std::string& parts = {},
                         const std::string& transition = "event=\"done.state.a\"") {
  return "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">\n"
         "<vehicle model=\"aqua2\" speed=\"0.4\"/><map file=\"maps/window.sdf\"/>\n"
         "<start x=\"0\" y=\"0\" z=\"1\" z_units=\"DEPTH\" heading_deg=\"0\"/>\n"
         "<limits max_depth=\"100\" min_altitude=\"0\" clearance=\"0.6\" mission_timeout=\"900\" "
         "battery_reserve=\"0.2\"/>\n" +
         parts + "<states initial=\"a\">\n<goto id=\"a\" " + attributes +
         " timeout=\"60\" on_timeout=\"up\"><transition " + transition +
         " target=\"up\"/></goto>\n"
         "<surface id=\"up\"><transition event=\"done.state.up\" target=\"end\"/></surface>\n"
         "<final id=\"end\"/></states></mission>\n";
}

std::optional<Mission> parse(const std::string& text, Diagnostics& diagnostics) {
  return parse_mission(SourceText(kWindow, text), diagnostics);
}

TEST(LoadMission, ReadsTheWindowMission) {
  Diagnostics diagnostics;
  const std::optional<Mission> mission = load_mission(kWindow, diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  EXPECT_EQ(mission->id, "window");
  EXPECT_EQ(mission->speed.value, 0.4);
  EXPECT_EQ(mission->attitude, planning::AttitudeMode::kHorizontal);
  EXPECT_EQ(mission->map_path,
            std::filesystem::canonical(DIVE_SOURCE_DIR "/missions/maps/window.sdf").string());
  EXPECT_EQ(mission->start.in_world(0.0), Eigen::Vector3d(-4.0, -2.0, -3.0));
  EXPECT_EQ(mission->limits.clearance.value, 1.0);
  EXPECT_EQ(at(mission->source, mission->limits.clearance.span), "1.0");
  EXPECT_EQ(mission->replan.period_s->value, 10.0);
  EXPECT_EQ(mission->replan.deviation_m->value, 0.5);
  EXPECT_EQ(mission->failsafes.policy(FailsafeKind::kLeak).persistence_s, 1.0);
  EXPECT_EQ(threshold(mission->failsafes, FailsafeKind::kPlannerFailure), 3.0);
  EXPECT_EQ(mission->initial.value, "gate");

  ASSERT_EQ(mission->states.size(), 4U);
  const StateSpec& rooms = mission->states[1];
  EXPECT_EQ(rooms.type, StateType::kCompound);
  EXPECT_TRUE(rooms.overhead);
  ASSERT_EQ(rooms.children.size(), 3U);
  EXPECT_TRUE(rooms.children[0].overhead) << "an overhead holds for what is inside";
  EXPECT_FALSE(mission->states[0].overhead);
  const std::vector<const Goal*> in = goals_of(rooms.children[0]);
  ASSERT_EQ(in.size(), 1U);
  EXPECT_EQ(in[0]->position.in_world(0.0), Eigen::Vector3d(9.8, -2.0, -4.6));
  EXPECT_EQ(in[0]->dwell_s.value, 2.0);
  EXPECT_FALSE(in[0]->heading_deg);
  EXPECT_EQ(at(mission->source, in[0]->position.z.span), "4.6");
  EXPECT_EQ(rooms.children[0].timeout->on_timeout.value, "out");
  const TransitionSpec& first = rooms.children[0].transitions.at(0);
  EXPECT_EQ(first.events, (std::vector<std::string>{"done.state.in", "plan.failed.in"}));
  EXPECT_EQ(at(mission->source, first.event_spans.at(1)), "plan.failed.in");
  EXPECT_EQ(at(mission->source, first.targets.at(0).span), "out");
  EXPECT_EQ(mission->states[3].type, StateType::kFinal);
}

TEST(LoadMission, FillsInDefaults) {
  Diagnostics diagnostics;
  const auto mission = parse(mission_text("x=\"1\" y=\"2\" z=\"-3\" z_units=\"Z\""), diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  EXPECT_EQ(mission->attitude, planning::AttitudeMode::kFree);
  EXPECT_FALSE(mission->replan.period_s || mission->replan.deviation_m);
  EXPECT_EQ(replans_per_leg(*mission, mission->replan), 50);
  EXPECT_FALSE(mission->unknown);
  EXPECT_EQ(mission->abort_authority, AbortAuthority::kAnyone);
  for (std::size_t i = 0; i < behaviors::kFailsafeCount; ++i) {
    const auto& traits = behaviors::traits(static_cast<behaviors::FailsafeKind>(i));
    EXPECT_FALSE(mission->failsafes.written[i]) << traits.name;
    if (traits.kind == FailsafeKind::kRangeLost) continue;  // depends on the environment
    EXPECT_EQ(mission->failsafes.policies[i].rung, traits.policy.rung) << traits.name;
  }
  const Failsafes& failsafes = mission->failsafes;
  EXPECT_EQ(failsafes.policy(FailsafeKind::kLeak).persistence_s, 1.0);
  EXPECT_EQ(failsafes.policy(FailsafeKind::kOverdepth).persistence_s, 2.0);
  EXPECT_EQ(failsafes.policy(FailsafeKind::kMissionTimeout).persistence_s, 0.0);
  EXPECT_EQ(threshold(failsafes, FailsafeKind::kBattery), 0.2) << "limits/@battery_reserve";
  EXPECT_EQ(threshold(failsafes, FailsafeKind::kPlannerFailure), 3.0);
  const Goal& go = *goals_of(mission->states[0]).at(0);
  EXPECT_EQ(go.capture_radius.value, 0.5);
  EXPECT_EQ(at(mission->source, go.capture_radius.span), "goto");
  EXPECT_EQ(go.id.value, "a");
  EXPECT_EQ(go.position.in_world(0.0), Eigen::Vector3d(1.0, 2.0, -3.0));
  EXPECT_FALSE(mission->states[0].transitions[0].guard);
  EXPECT_FALSE(mission->states[0].transitions[0].internal);
}

TEST(LoadMission, ReadsWhoseAbortIsAccepted) {
  const std::string place = "x=\"1\" y=\"2\" z=\"3\" z_units=\"DEPTH\"";
  Diagnostics diagnostics;
  const auto mission = parse(mission_text(place, "<operator abort=\"key\"/>"), diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  EXPECT_EQ(mission->abort_authority, AbortAuthority::kKey);
  EXPECT_FALSE(parse(mission_text(place, "<operator abort=\"none\"/>"), diagnostics));
}

TEST(LoadMission, ReadsFailsafesAsWritten) {
  Diagnostics diagnostics;
  const auto mission =
      parse(mission_text("x=\"1\" y=\"2\" z=\"3\" z_units=\"ALTITUDE\"",
                         "<failsafes><mission_timeout rung=\"warn\" persistence=\"7\" clear=\"8\"/>"
                         "<leak rung=\"emergency_surface\"/><planner_failure rung=\"replan\" "
                         "failures=\"9\"/><battery rung=\"hold\" below=\"0.5\"/>"
                         "<geofence rung=\"retrace\"><corner x=\"0\" y=\"0\"/><corner x=\"9\" "
                         "y=\"0\"/><corner x=\"9\" y=\"9\"/></geofence></failsafes>"),
            diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  const Failsafes& failsafes = mission->failsafes;
  const auto rung = [&](FailsafeKind kind) { return failsafes.policy(kind).rung; };
  EXPECT_EQ(rung(FailsafeKind::kMissionTimeout), behaviors::Rung::kWarn);
  EXPECT_EQ(failsafes.policy(FailsafeKind::kMissionTimeout).persistence_s, 7.0);
  EXPECT_EQ(failsafes.policy(FailsafeKind::kMissionTimeout).clear_s, 8.0);
  EXPECT_EQ(rung(FailsafeKind::kLeak), behaviors::Rung::kEmergencySurface);
  EXPECT_EQ(rung(FailsafeKind::kOverdepth), behaviors::Rung::kAbortAndSurface);
  EXPECT_EQ(rung(FailsafeKind::kPlannerFailure), behaviors::Rung::kReplan);
  EXPECT_EQ(threshold(failsafes, FailsafeKind::kPlannerFailure), 9.0);
  EXPECT_EQ(rung(FailsafeKind::kBattery), behaviors::Rung::kHold);
  EXPECT_EQ(threshold(failsafes, FailsafeKind::kBattery), 0.5);
  EXPECT_EQ(rung(FailsafeKind::kGeofence), behaviors::Rung::kRetrace);
  ASSERT_EQ(failsafes.fence.size(), 3U);
  EXPECT_EQ(failsafes.fence[2][1].value, 9.0);
  EXPECT_EQ(at(mission->source, *failsafes.written[0]), "leak");
  EXPECT_EQ(goals_of(mission->states[0]).at(0)->position.in_world(-20.0).z(), -17.0);
}

TEST(LoadMission, ReadsAnUnknownEnvironment) {
  const std::string goal = "x=\"1\" y=\"2\" z=\"3\" z_units=\"DEPTH\"";
  const auto with = [&](const std::string& map, const std::string& parts = {}) {
    std::string text = mission_text(goal, parts);
    const std::string known = "<map file=\"maps/window.sdf\"/>";
    Diagnostics diagnostics;
    auto mission = parse(text.replace(text.find(known), known.size(), map), diagnostics);
    EXPECT_TRUE(mission) << rendered(diagnostics);
    return mission;
  };
  const auto rehearsed = with("<map unknown=\"cautious\" simulation_map=\" maps/window.sdf \"/>");
  EXPECT_EQ(rehearsed->unknown, UnknownPolicy::kCautious);
  EXPECT_EQ(rehearsed->memory_s, 600.0);
  EXPECT_EQ(rehearsed->map_file.value, "maps/window.sdf");
  EXPECT_EQ(at(rehearsed->source, rehearsed->map_file.span), "maps/window.sdf");
  EXPECT_EQ(rehearsed->map_path,
            std::filesystem::canonical(DIVE_SOURCE_DIR "/missions/maps/window.sdf").string());
  EXPECT_TRUE(has_simulation_map(*rehearsed));
  EXPECT_EQ(replans_per_leg(*rehearsed, rehearsed->replan), 400);

  const auto alone =
      with("<map unknown=\"optimistic\" memory_s=\"90\"/>", "<replan max_replans=\"7\"/>");
  EXPECT_EQ(alone->unknown, UnknownPolicy::kOptimistic);
  EXPECT_EQ(alone->memory_s, 90.0);
  EXPECT_EQ(alone->map_file.value + alone->map_path, "");
  EXPECT_EQ(at(alone->source, alone->map_file.span), "map");
  EXPECT_FALSE(has_simulation_map(*alone));
  EXPECT_EQ(replans_per_leg(*alone, alone->replan), 7);
}

TEST(LoadMission, ReadsWhetherLoopsAreClosed) {
  const auto closes_loops = [](const std::string& estimation) {
    Diagnostics diagnostics;
    const auto mission =
        parse(mission_text("x=\"1\" y=\"0\" z=\"1\" z_units=\"DEPTH\"", estimation), diagnostics);
    EXPECT_TRUE(mission) << rendered(diagnostics);
    return mission && mission->closes_loops;
  };
  EXPECT_TRUE(closes_loops("<estimation estimator=\"visual_inertial\"/>"));
  EXPECT_FALSE(closes_loops("<estimation estimator=\"visual_inertial\" loop_closure=\"false\"/>"));
}

TEST(LoadMission, UsesFixesInAKnownMapUnlessToldOtherwise) {
  const auto load = [](const std::string& fixes, const std::string& estimation) {
    std::string text = mission_text("x=\"1\" y=\"0\" z=\"1\" z_units=\"DEPTH\"", estimation);
    text.insert(text.find("<map ") + 5, fixes);
    Diagnostics diagnostics;
    auto mission = parse(text, diagnostics);
    EXPECT_TRUE(mission) << rendered(diagnostics);
    return *std::move(mission);
  };
  EXPECT_TRUE(uses_map_fixes(load("", "")));
  EXPECT_TRUE(uses_map_fixes(load("fixes=\"on\" ", "")));
  EXPECT_FALSE(uses_map_fixes(load("fixes=\"off\" ", "")));
  EXPECT_TRUE(uses_map_fixes(load("", "<estimation estimator=\"visual_inertial\"/>")));
  const Mission with_tag =
      load("",
           "<estimation estimator=\"visual_inertial\"><tag id=\"3\" size=\"0.4\" x=\"1\" y=\"0\" "
           "z=\"2\" z_units=\"DEPTH\" heading_deg=\"270\"/></estimation>");
  EXPECT_FALSE(uses_map_fixes(with_tag)) << "tags give the position themselves";
}

TEST(LoadMission, TurnsBackWithoutRangeDataInAKnownMap) {
  const auto rung = [](const std::string& map, const std::string& failsafes) {
    std::string text = mission_text("x=\"1\" y=\"0\" z=\"1\" z_units=\"DEPTH\"");
    text.insert(text.find("<map ") + 5, map);
    text.insert(text.find("<states"), failsafes);
    Diagnostics diagnostics;
    const auto mission = parse(text, diagnostics);
    EXPECT_TRUE(mission) << rendered(diagnostics);
    return mission->failsafes.policy(behaviors::FailsafeKind::kRangeLost).rung;
  };
  EXPECT_EQ(rung("", ""), behaviors::Rung::kAbortAndSurface);
  EXPECT_EQ(rung("", "<failsafes><range_lost rung=\"warn\"/></failsafes>"), behaviors::Rung::kWarn);
}

TEST(LoadMission, MapsWhatAKnownMapLacksWhereARangeCameraCorrectsThePosition) {
  const auto sensor = [](const std::string& map, const std::string& estimation = {}) {
    std::string text = mission_text("x=\"1\" y=\"0\" z=\"1\" z_units=\"DEPTH\"", estimation);
    text.insert(text.find("<map ") + 5, map);
    Diagnostics diagnostics;
    const auto mission = parse(text, diagnostics);
    EXPECT_TRUE(mission) << rendered(diagnostics);
    return mapping_sensor(*mission);
  };
  const std::string by_sight = "<estimation estimator=\"visual_inertial\"/>";
  EXPECT_EQ(sensor(""), MappingSensor::kRangeCamera);
  EXPECT_EQ(sensor("mapping_sensor=\"none\" "), MappingSensor::kNone);
  EXPECT_EQ(sensor("fixes=\"off\" "), MappingSensor::kNone);
  EXPECT_EQ(sensor("fixes=\"off\" mapping_sensor=\"range_camera\" "), MappingSensor::kRangeCamera);
  EXPECT_EQ(sensor("", by_sight), MappingSensor::kRangeCamera);
  EXPECT_EQ(sensor("fixes=\"off\" ", by_sight), MappingSensor::kNone);
  EXPECT_EQ(sensor("mapping_sensor=\"stereo\" ", by_sight), MappingSensor::kStereo);
}

TEST(LoadMission, ReadsWhatIsKnownBeforeTheDive) {
  const auto priors = [](const std::string& map, const std::string& start,
                         const std::string& parts) {
    std::string text = mission_text("x=\"1\" y=\"0\" z=\"1\" z_units=\"DEPTH\"", parts);
    text.insert(text.find("<map ") + 5, map);
    text.insert(text.find("<start ") + 7, start);
    Diagnostics diagnostics;
    const auto mission = parse(text, diagnostics);
    EXPECT_TRUE(mission) << rendered(diagnostics);
    return mission->priors;
  };
  const Priors usual = priors("", "", "");
  EXPECT_EQ(usual.start_m, 0.1);
  EXPECT_EQ(usual.map_m, 0.05);
  EXPECT_EQ(usual.map_deg, 0.5);
  EXPECT_EQ(usual.current, 0.02);
  const Priors written =
      priors("sigma_m=\"0.3\" sigma_deg=\"1\" ", "sigma=\"2\" ", "<current sigma=\"0.05\"/>");
  EXPECT_EQ(written.start_m, 2.0);
  EXPECT_EQ(written.map_m, 0.3);
  EXPECT_EQ(written.map_deg, 1.0);
  EXPECT_EQ(written.current, 0.05);
}

TEST(LoadMission, ReadsGuards) {
  Diagnostics diagnostics;
  const auto mission =
      parse(mission_text("x=\"1\" y=\"2\" z=\"3\" z_units=\"DEPTH\"", {},
                         "event=\"done.state.a\" cond=\"depth &gt; 2 and depth &lt;&#61; 4\""),
            diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  const Guard& guard = mission->states[0].transitions[0].guard.value();
  GuardVariables variables;
  variables.depth = 4.0;
  EXPECT_TRUE(guard.evaluate(variables));
  variables.depth = 4.5;
  EXPECT_FALSE(guard.evaluate(variables));
}

// The caret points at the mistake itself, however the value was written.
TEST(LoadMission, FindsThePlaceInsideACondition) {
  for (const std::string before :
       {"depth &gt; 2 and ", "depth &#x3E;&#61; 2 or ", "depth > 2\n or ", "(depth &lt; 2) and\t",
        "clearance > 1 and not "}) {
    Diagnostics diagnostics;
    const std::string text = mission_text("x=\"1\" y=\"2\" z=\"3\" z_units=\"DEPTH\"", {},
                                          "event=\"done.state.a\" cond=\"" + before + "wrong\"");
    EXPECT_FALSE(parse(text, diagnostics));
    ASSERT_EQ(diagnostics.list().size(), 1U);
    const Diagnostic& found = diagnostics.list()[0];
    EXPECT_EQ(found.code, "MIS-COND");
    EXPECT_EQ(found.source_line.substr(static_cast<std::size_t>(found.span.column - 1), 5), "wrong")
        << before;
  }
}

// Every number that the schema accepts has the value that strtod gives, and every number out of
// range is rejected with its own caret.
RC_GTEST_PROP(LoadMission, ReadsEveryNumber, ()) {
  const int sign = *rc::gen::element(-1, 1);
  const int whole = *rc::gen::inRange(0, 120'000);
  const int fraction = *rc::gen::inRange(0, 1000);
  const std::string form =
      *rc::gen::element<std::string>("{}{}.{:03}", "{}0{}.{:03}000", " {}{}.{:03} ");
  const std::string plus = *rc::gen::element<std::string>("", "+");
  const std::string written =
      fmt::format(fmt::runtime(form), sign < 0 ? "-" : plus, whole, fraction);
  const double value = std::strtod(written.c_str(), nullptr);
  Diagnostics diagnostics;
  const auto mission =
      parse(mission_text(fmt::format("x=\"{}\" y=\"2\" z=\"3\" z_units=\"DEPTH\"", written)),
            diagnostics);
  if (std::abs(value) <= 100'000.0) {
    RC_ASSERT(mission.has_value());
    RC_ASSERT(goals_of(mission->states[0]).at(0)->position.x.value == value);
  } else {
    RC_ASSERT(!mission);
    RC_ASSERT(diagnostics.list().size() == 1U);
    RC_ASSERT(diagnostics.list()[0].code == "XSD-VALUE");
    RC_ASSERT(diagnostics.list()[0].span.length == static_cast<int>(written.size()));
  }
}

TEST(LoadMission, ReadsEveryFormOfADecimal) {
  for (const auto& [written, value] : {std::pair<std::string, double>{"5.", 5.0},
                                       {".5", 0.5},
                                       {"-.5", -0.5},
                                       {"-0", 0.0},
                                       {"000012.250", 12.25},
                                       {"0.123456789012345678", 0.123456789012345678}}) {
    Diagnostics diagnostics;
    const auto mission =
        parse(mission_text(fmt::format("x=\"{}\" y=\"2\" z=\"3\" z_units=\"DEPTH\"", written)),
              diagnostics);
    ASSERT_TRUE(mission) << written << "\n" << rendered(diagnostics);
    EXPECT_EQ(goals_of(mission->states[0]).at(0)->position.x.value, value) << written;
  }
}

// Two mistakes of each stage, far from each other, are both reported.
TEST(LoadMission, ReportsEveryMistakeOfAStage) {
  Diagnostics schema;
  EXPECT_FALSE(parse(mission_text("x=\"NaN\" y=\"2\" z=\"3\"", "<replan perid=\"3\"/>"), schema));
  ASSERT_EQ(schema.list().size(), 3U) << rendered(schema);
  EXPECT_EQ(schema.list()[0].code, "XSD-ATTRIBUTE");
  EXPECT_EQ(schema.list()[1].code, "XSD-MISSING-ATTRIBUTE");
  EXPECT_EQ(schema.list()[2].code, "XSD-VALUE");

  Diagnostics semantic;
  EXPECT_FALSE(parse(mission_text("x=\"1\" y=\"2\" z=\"300\" z_units=\"DEPTH\"", {},
                                  "event=\"done.state.b\" cond=\"dept > 3\""),
                     semantic));
  ASSERT_EQ(semantic.list().size(), 3U) << rendered(semantic);
  EXPECT_EQ(semantic.list()[0].code, "MIS-TOO-DEEP");
  EXPECT_EQ(semantic.list()[1].code, "MIS-EVENT");
  EXPECT_EQ(semantic.list()[2].code, "MIS-COND");
}

TEST(ParseMission, SearchesTheMapBesideTheSource) {
  Diagnostics diagnostics;
  const std::string text = mission_text("x=\"1\" y=\"2\" z=\"3\" z_units=\"DEPTH\"");
  EXPECT_FALSE(parse_mission(SourceText("/no/such/folder/m.xml", text), diagnostics));
  ASSERT_EQ(diagnostics.list().size(), 1U);
  EXPECT_EQ(diagnostics.list()[0].code, "MIS-MAP-NOT-FOUND");
}

TEST(HeadingToYaw, IsEastAtNinetyAndCounterClockwise) {
  EXPECT_NEAR(heading_to_yaw(90.0), 0.0, 1e-12);
  EXPECT_NEAR(heading_to_yaw(0.0), 1.5707963267948966, 1e-12);
  EXPECT_NEAR(heading_to_yaw(180.0), -1.5707963267948966, 1e-12);
  EXPECT_NEAR(heading_to_yaw(45.0), 0.7853981633974483, 1e-12);
}

// The states of a document with the given `states`, which end in <surface id="up"/>.
std::optional<Mission> parse_states(const std::string& states, Diagnostics& diagnostics) {
  std::string text = mission_text("x=\"1\" y=\"2\" z=\"3\" z_units=\"DEPTH\"");
  const std::size_t begin = text.find("<goto");
  const std::size_t end = text.find("<surface");
  return parse(text.replace(begin, end - begin, states), diagnostics);
}

std::vector<Eigen::Vector3d> goals_in_world(const StateSpec& spec) {
  std::vector<Eigen::Vector3d> points;
  for (const Goal* goal : goals_of(spec)) {
    points.push_back(goal->position.in_world(-20.0));
  }
  return points;
}

TEST(Transect, RowsAreMownToAndFro) {
  Diagnostics diagnostics;
  const auto mission = parse_states(
      "<transect id=\"a\" z=\"5\" z_units=\"DEPTH\" timeout=\"800\" on_timeout=\"up\">"
      "<rows x=\"1\" y=\"2\" heading_deg=\"0\" length=\"30\" spacing=\"4\" count=\"3\"/>"
      "<leg from_x=\"0\" from_y=\"0\" to_x=\"-7\" to_y=\"0\"/>"
      "<transition event=\"done.state.a\" target=\"up\"/></transect>",
      diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  const std::vector<Eigen::Vector3d> expected = {{1, 2, -5}, {1, 32, -5}, {5, 32, -5}, {5, 2, -5},
                                                 {9, 2, -5}, {9, 32, -5}, {0, 0, -5},  {-7, 0, -5}};
  const std::vector<Eigen::Vector3d> goals = goals_in_world(mission->states[0]);
  ASSERT_EQ(goals.size(), expected.size());
  for (std::size_t i = 0; i < goals.size(); ++i) {
    EXPECT_LT((goals[i] - expected[i]).norm(), 1e-9) << i;
  }
  EXPECT_EQ(mission->states[0].element, "transect");
}

TEST(Transect, AtAnAltitudeItHasAGoalAtLeastEveryTenMetres) {
  Diagnostics diagnostics;
  const auto mission = parse_states(
      "<transect id=\"a\" z=\"2\" z_units=\"ALTITUDE\" timeout=\"800\" on_timeout=\"up\">"
      "<rows x=\"0\" y=\"0\" heading_deg=\"90\" length=\"12\" spacing=\"4\" count=\"2\" "
      "side=\"left\"/><transition event=\"done.state.a\" target=\"up\"/></transect>",
      diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  const std::vector<Eigen::Vector3d> goals = goals_in_world(mission->states[0]);
  ASSERT_EQ(goals.size(), 6U);
  EXPECT_LT((goals[1] - Eigen::Vector3d(6, 0, -18)).norm(), 1e-9);
  EXPECT_LT((goals[3] - Eigen::Vector3d(12, 4, -18)).norm(), 1e-9) << "to the left of east";
}

TEST(WreckPenetration, IsMadeOfStates) {
  Diagnostics diagnostics;
  const auto mission = parse_states(
      "<wreck_penetration id=\"a\" max_penetration=\"20\" turn_back=\"0.25\" timeout=\"800\" "
      "on_timeout=\"back\"><replan period=\"7\"/>"
      "<entry x=\"0\" y=\"0\" z=\"5\" z_units=\"DEPTH\"/>"
      "<goal id=\"g1\" x=\"5\" y=\"0\" z=\"5\" z_units=\"DEPTH\"/>"
      "<goal id=\"g2\" x=\"9\" y=\"0\" z=\"5\" z_units=\"DEPTH\"/>"
      "<transition event=\"done.state.a plan.failed.a\" target=\"up\"/></wreck_penetration>"
      "<retrace id=\"back\"><transition event=\"done.state.back\" target=\"up\"/></retrace>",
      diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  const StateSpec& whole = mission->states[0];
  EXPECT_EQ(whole.type, StateType::kCompound);
  EXPECT_EQ(whole.initial->value, "a-entry");
  EXPECT_EQ(whole.timeout->on_timeout.value, "back");
  ASSERT_EQ(whole.children.size(), 5U);
  const auto& [entry, inside, out, retrace, end] =
      std::tie(whole.children[0], whole.children[1], whole.children[2], whole.children[3],
               whole.children[4]);
  EXPECT_FALSE(entry.overhead);
  EXPECT_TRUE(inside.overhead && out.overhead && retrace.overhead);
  EXPECT_EQ(goals_in_world(inside).size(), 2U);
  EXPECT_EQ(inside.replan->period_s->value, 7.0);
  EXPECT_EQ(goals_of(out).at(0)->position.x.value, 0.0) << "out where it came in";
  EXPECT_TRUE(is_retracing(retrace));
  EXPECT_EQ(end.type, StateType::kFinal);
  const Guard& turn_back = *inside.transitions.at(1).guard;
  GuardVariables variables;
  EXPECT_FALSE(turn_back.evaluate(variables));
  variables.penetration = 20.5;
  EXPECT_TRUE(turn_back.evaluate(variables));
  variables.penetration = 1.0;
  variables.budget_used = 0.26;
  EXPECT_TRUE(turn_back.evaluate(variables));
}

TEST(Actions, AreReadWhereTheyStand) {
  Diagnostics diagnostics;
  const auto mission = parse_states(
      "<hold id=\"a\" duration=\"5\"><onentry><log message=\"a &lt; b\"/><payload "
      "command=\"lights_on\" once=\"true\"/></onentry><onexit><raise event=\"seen.it\"/></onexit>"
      "<transition event=\"done.state.a\" target=\"up\"><log message=\"up\"/></transition>"
      "<transition event=\"seen\" target=\"up\"/></hold>",
      diagnostics);
  ASSERT_TRUE(mission) << rendered(diagnostics);
  const StateSpec& a = mission->states[0];
  ASSERT_EQ(a.on_entry.size(), 2U);
  EXPECT_EQ(a.on_entry[0].text.value, "a < b");
  EXPECT_EQ(a.on_entry[1].kind, ActionSpec::Kind::kPayload);
  EXPECT_TRUE(a.on_entry[1].once);
  EXPECT_EQ(a.on_exit.at(0).kind, ActionSpec::Kind::kRaise);
  EXPECT_EQ(a.transitions[0].actions.at(0).text.value, "up");
}

}  // namespace
}  // namespace dive::mission
