// The parts of a scenario beside the command: its vocabulary, its limits, its JUnit.

#include "mission/scenario/scenario.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "behaviors/failsafes.h"
#include "behaviors/replan_triggers.h"
#include "common/xml.h"
#include "mission/scenario/junit.h"
#include "vehicle/simulator/simulator.h"
#include "vehicle/simulator/water/named_waters.h"

namespace dive::mission {
namespace {

using ::testing::UnorderedElementsAreArray;

// The values of an enumeration in a schema.
std::vector<std::string> listed(const std::string& type, const std::string& file = "scenario.xsd") {
  Diagnostics diagnostics;
  const auto schema = read_xml(DIVE_SOURCE_DIR "/missions/" + file, XmlLimits{}, diagnostics);
  std::vector<std::string> values;
  for (const XmlElement& element : schema.value().root.children) {
    const XmlAttribute* name = element.attribute("name");
    if (element.name != "simpleType" || name == nullptr || name->value != type) continue;
    for (const XmlElement& facet : element.child("restriction")->children) {
      values.push_back(facet.attribute("value")->value);
    }
  }
  return values;
}

TEST(ScenarioSchema, ListsWhatThereIs) {
  std::vector<std::string> faults;
  for (std::size_t i = 0; i < kFaultCount; ++i) {
    faults.emplace_back(to_string(static_cast<FaultKind>(i)));
  }
  EXPECT_THAT(listed("FaultName"), UnorderedElementsAreArray(faults));

  std::vector<std::string> failsafes;
  for (std::size_t i = 0; i < behaviors::kFailsafeCount; ++i) {
    failsafes.emplace_back(to_string(static_cast<behaviors::FailsafeKind>(i)));
  }
  EXPECT_THAT(listed("FailsafeName"), UnorderedElementsAreArray(failsafes));

  std::vector<std::string> conditions;
  for (const auto& [name, value] : vehicle::Conditions{}.list()) conditions.push_back(name);
  EXPECT_THAT(listed("Condition"), UnorderedElementsAreArray(conditions));

  std::vector<std::string> causes;
  for (int i = static_cast<int>(behaviors::ReplanCause::kPeriod);
       i <= static_cast<int>(behaviors::ReplanCause::kDemanded); ++i) {
    causes.emplace_back(to_string(static_cast<behaviors::ReplanCause>(i)));
    std::ranges::replace(causes.back(), ' ', '_');
  }
  EXPECT_THAT(listed("ReplanCause"), UnorderedElementsAreArray(causes));

  std::vector<std::string> commands;
  for (int i = 0; i <= static_cast<int>(kLastTopsideCommand); ++i) {
    commands.emplace_back(to_string(static_cast<OperatorCommand>(i)));
    EXPECT_EQ(find_operator_command(commands.back()), static_cast<OperatorCommand>(i));
  }
  EXPECT_THAT(listed("OperatorCommand"), UnorderedElementsAreArray(commands));
  EXPECT_FALSE(find_operator_command("SIGTERM")) << "a signal, not a request";

  EXPECT_THAT(listed("Stream"), UnorderedElementsAreArray(kSampleStreamNames));
  EXPECT_EQ(find_sample_stream("health"), SampleStream::kHealth);
  EXPECT_EQ(find_sample_stream("all"), SampleStream::kAll);

  for (const std::string& rung : listed("Rung")) {
    EXPECT_TRUE(rung == "none" || behaviors::find_rung(rung)) << rung;
  }
}

TEST(MissionSchema, ListsTheWatersThereAre) {
  EXPECT_THAT(listed("Water", "mission.xsd"), UnorderedElementsAreArray(vehicle::water_names()));
}

TEST(ScenarioFile, IsBounded) {
  std::string steps;
  for (int i = 0; i < 201; ++i) steps += "<description>x</description>";
  const std::string begin = "<scenario xmlns=\"urn:dive:scenario:1\" id=\"s\" mission=\"m.xml\">";
  Diagnostics many;
  EXPECT_FALSE(parse_scenario(SourceText("s.xml", begin + steps + "</scenario>"), many));
  Diagnostics large;
  EXPECT_FALSE(parse_scenario(
      SourceText("s.xml", begin + std::string(300'000, ' ') + "</scenario>"), large));
  EXPECT_EQ(large.list().at(0).code, "XML-SIZE");
}

TEST(ScenarioFile, FindsItsMissionFromItsOwnFolder) {
  Diagnostics diagnostics;
  const auto scenario = parse_scenario(
      SourceText("a/b/s.xml",
                 "<scenario xmlns=\"urn:dive:scenario:1\" id=\"s\" mission=\"../m.xml\" seed=\"7\">"
                 "<expect><outcome is=\"success\"/></expect></scenario>"),
      diagnostics);
  ASSERT_TRUE(scenario);
  EXPECT_EQ(scenario->mission_path, "a/m.xml");
  EXPECT_EQ(scenario->seed, 7U);
}

TEST(ScenarioFile, HasTheDiversTrack) {
  Diagnostics diagnostics;
  const auto scenario = parse_scenario(
      SourceText("s.xml",
                 "<scenario xmlns=\"urn:dive:scenario:1\" id=\"s\" mission=\"m.xml\">"
                 "<diver start=\"4\" speed=\"0.3\" keeps=\"2\">"
                 "<waypoint x=\"1\" y=\"2\" depth=\"3\" pause=\"5\"/>"
                 "<waypoint x=\"-1\" y=\"0\" depth=\"0\"/></diver>"
                 "<expect><outcome is=\"success\"/></expect></scenario>"),
      diagnostics);
  ASSERT_TRUE(scenario);
  ASSERT_TRUE(scenario->diver);
  const vehicle::DiverTrack& track = *scenario->diver;
  EXPECT_EQ(track.start_s, 4.0);
  EXPECT_EQ(track.speed, 0.3);
  EXPECT_EQ(track.keeps_m, 2.0);
  ASSERT_EQ(track.waypoints.size(), 2U);
  EXPECT_EQ(track.waypoints[0].p_W, Eigen::Vector3d(1, 2, -3));
  EXPECT_EQ(track.waypoints[0].pause_s, 5.0);
  EXPECT_EQ(track.waypoints[1].p_W, Eigen::Vector3d(-1, 0, 0));
  EXPECT_EQ(track.waypoints[1].pause_s, 0.0);
}

TEST(JUnit, IsWellFormedWhateverStandsInIt) {
  TestCase test;
  test.name = "a<b>&\"c\"";
  test.folder = std::string("zero\0byte", 9);
  test.folder.append("\xff\xc0\xaf \xed\xa0\x80 \xef\xbf\xbe \x01");
  test.failures = {"line 1\nline 2 ]]> &amp;", "\xe2\x82"};
  test.error = "caf\xc3\xa9 \xf0\x9f\x90\x9f";
  Diagnostics diagnostics;
  const auto document =
      parse_xml(SourceText("junit.xml", to_junit({test, {}})), XmlLimits{}, diagnostics);
  ASSERT_TRUE(document) << render(diagnostics.list().at(0), false);
  const XmlElement& first = document->root.children.at(0).children.at(0);
  EXPECT_EQ(first.attribute("name")->value, test.name);
  EXPECT_EQ(first.child("error")->attribute("message")->value, test.error);
  EXPECT_EQ(first.child("failure")->text, "line 1\nline 2 ]]> &amp;\n??");
}

}  // namespace
}  // namespace dive::mission
