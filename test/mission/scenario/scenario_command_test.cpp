// The interface of `dive test`.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "common/xml.h"
#include "test/common/long_tests.h"
#include "test/common/sanitizers.h"
#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;
using testing::Ran;

const fs::path kShipped = fs::path(DIVE_SOURCE_DIR) / "missions/scenarios";
const fs::path kMalformed = fs::path(DIVE_SOURCE_DIR) / "test/mission/scenario/malformed";

std::string in_quotes(const fs::path& path) { return fmt::format("'{}'", path.string()); }

fs::path own_folder() {
  const auto& test = *::testing::UnitTest::GetInstance()->current_test_info();
  const fs::path folder = fs::path(::testing::TempDir()) / "dive-scenarios" / test.name();
  fs::create_directories(folder);
  return folder;
}

Ran dive(const std::string& arguments) {
  const auto& test = *::testing::UnitTest::GetInstance()->current_test_info();
  return testing::run_dive(arguments, test.name());
}

// A scenario of the dart mission, in a separate folder for each test.
fs::path scenario(const std::string& name, const std::string& body) {
  const fs::path folder = own_folder();
  const fs::path mission = fs::relative(kShipped / "missions/dart.xml", folder);
  std::ofstream(folder / (name + ".xml")) << "<scenario xmlns=\"urn:dive:scenario:1\" id=\"" << name
                                          << "\" mission=\"" << mission.string() << "\">\n"
                                          << body << "\n</scenario>\n";
  return folder / (name + ".xml");
}

const std::string kLeak = "<at state=\"east\" after=\"3\"><fault name=\"leak\"/></at>\n";

TEST(ScenarioCommand, RefusesEveryMalformedScenarioWithItsCodeAndLine) {
  struct Error {
    std::string code;
    int line = 0;
    std::string phrase;
  };
  std::map<std::string, std::vector<Error>> expected;
  std::ifstream stream(kMalformed / "expectations.txt");
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    std::string file;
    Error error;
    if (!(words >> file >> error.code >> error.line)) continue;
    std::getline(words >> std::ws, error.phrase);
    expected[file].push_back(error);
  }
  ASSERT_GE(expected.size(), 40U);
  for (const auto& entry : fs::directory_iterator(kMalformed)) {
    if (entry.path().extension() != ".xml") continue;
    EXPECT_TRUE(expected.contains(entry.path().filename().string())) << entry.path();
  }
  for (const auto& [file, errors] : expected) {
    const Ran ran = dive("test --json " + in_quotes(kMalformed / file));
    EXPECT_EQ(ran.status, 2) << file;
    const auto found = nlohmann::json::parse(ran.out).at("scenarios").at(0).at("diagnostics");
    ASSERT_EQ(found.size(), errors.size()) << file << found.dump(1);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      EXPECT_EQ(found[i].at("code"), errors[i].code) << file;
      EXPECT_EQ(found[i].at("line"), errors[i].line) << file;
      EXPECT_THAT(
          found[i].at("message").get<std::string>() + found[i].at("hint").get<std::string>(),
          HasSubstr(errors[i].phrase))
          << file;
    }
  }
}

TEST(ScenarioCommand, EveryCodeThatIsReportedIsListed) {
  const Ran rules = dive("test --rules");
  EXPECT_EQ(rules.status, 0);
  std::istringstream lines(testing::content_of(kMalformed / "expectations.txt"));
  for (std::string file, code, rest; lines >> file >> code; std::getline(lines, rest)) {
    if (!code.starts_with("SCN-")) continue;
    EXPECT_THAT(rules.out, HasSubstr(code));
  }
}

// Under the sanitizers without the scenarios that render minutes of images: shorter ones run the
// same code.
std::string shipped_scenarios() {
  if (!dive::testing::kUnderSanitizers) return in_quotes(kShipped);
  std::string all;
  for (const auto& entry : fs::directory_iterator(kShipped)) {
    const std::string name = entry.path().stem().string();
    const bool is_long =
        name == "a_place_is_recognised" || name == "dark_in_a_wreck_visual_inertial" ||
        name == "shipped_pool_diver_visual_inertial" ||
        name == "shipped_pool_obstacles_visual_inertial" || name == "shipped_wreck_visual_inertial";
    if (entry.path().extension() == ".xml" && !is_long) all += in_quotes(entry.path()) + ' ';
  }
  return all;
}

// The field team's regression tests: all pass, and each of their expectations fails when negated.
TEST(ScenarioCommand, AllShippedScenariosHoldAndNoneExpectsNothing) {
  const Ran ran = dive("test --negate --json " + shipped_scenarios());
  EXPECT_EQ(ran.status, 0);
  const auto report = nlohmann::json::parse(ran.out);
  EXPECT_GE(report.at("scenarios").size(), 60U);
  for (const auto& one : report.at("scenarios")) {
    EXPECT_TRUE(one.at("ok").get<bool>()) << one.dump(1);
    EXPECT_GE(one.at("expectations").get<int>(), 3) << one.at("id");
    EXPECT_EQ(one.at("id"), fs::path(one.at("file").get<std::string>()).stem().string());
  }
}

// Some scenarios expect that the script has no effect; all others fail when it is disabled.
TEST(ScenarioCommand, ShippedScenariosNoticeThatTheirScriptDoesNothing) {
  DIVE_SKIP_UNDER_SANITIZERS("the code is that of the scenarios that hold");
  DIVE_SKIP_LONG_TEST();
  const Ran ran = dive("test --disable-scripts --json " + in_quotes(kShipped));
  EXPECT_EQ(ran.status, 1);
  std::vector<std::string> insensitive;
  const auto report = nlohmann::json::parse(ran.out);
  for (const auto& one : report.at("scenarios")) {
    if (one.at("insensitive").get<bool>()) insensitive.push_back(one.at("id"));
  }
  EXPECT_THAT(insensitive,
              ::testing::ElementsAre("depth_loses_half", "depth_silent_for_a_moment",
                                     "everything_loses_two_fifths", "health_silent_for_a_moment",
                                     "imu_loses_a_third", "overheated_for_a_moment",
                                     "samples_lose_two_fifths"));
}

// Every script action and expectation occurs in a shipped scenario.
TEST(ScenarioCommand, TheShippedScenariosCoverTheLanguage) {
  std::string all;
  for (const auto& entry : fs::directory_iterator(kShipped)) {
    if (entry.path().extension() == ".xml") all += testing::content_of(entry.path());
  }
  Diagnostics diagnostics;
  const auto schema = read_xml(DIVE_SOURCE_DIR "/missions/scenario.xsd", XmlLimits{}, diagnostics);
  ASSERT_TRUE(schema);
  const auto listed = [&](const std::string& type) {
    std::vector<std::string> values;
    for (const XmlElement& element : schema->root.children) {
      const XmlAttribute* name = element.attribute("name");
      if (element.name != "simpleType" || name == nullptr || name->value != type) continue;
      for (const XmlElement& facet : element.child("restriction")->children) {
        values.push_back(facet.attribute("value")->value);
      }
    }
    EXPECT_FALSE(values.empty()) << type;
    return values;
  };
  const auto is_used = [&](const std::string& words) {
    return all.find(words) != std::string::npos;
  };
  for (const char* type : {"FaultName", "OperatorCommand", "Stream", "Outcome", "Rung"}) {
    for (const std::string& value : listed(type)) {
      // It means a collision: no shipped scenario may expect that.
      if (type == std::string_view("Outcome") && value == "failure") continue;
      EXPECT_TRUE(is_used(fmt::format("\"{}\"", value))) << value;
    }
  }
  for (const std::string& value : listed("FailsafeName")) {
    if (value == "internal_error") continue;   // it cannot be provoked
    if (value == "log_lost") continue;         // the log of a simulated dive loses nothing
    if (value == "retrace_failure") continue;  // its emergency ascent would end at the overhead
    EXPECT_TRUE(is_used(fmt::format("\"{}\"", value))) << value;
  }
  for (const std::string& value : listed("ReplanCause")) {
    EXPECT_TRUE(is_used(fmt::format("<replan cause=\"{}\"", value))) << value;
  }
}

TEST(ScenarioCommand, AFailureReportsTheActualResultAndTheExpectationsPlace) {
  const fs::path path = scenario(
      "wrong", kLeak + "<expect>\n<outcome is=\"success\"/>\n<enters state=\"north\"/>\n</expect>");
  const Ran ran = dive("test " + in_quotes(path));
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.out, HasSubstr("FAILED   wrong"));
  EXPECT_THAT(ran.out,
              HasSubstr(path.string() + ":4:2: expected outcome success; actual: aborted"));
  EXPECT_THAT(ran.out,
              HasSubstr(path.string() + ":5:2: expected state north is entered; actual: "));
  EXPECT_THAT(ran.out, HasSubstr("--keep DIR"));
}

TEST(ScenarioCommand, TheLogOfAFailureIsKeptAndReplays) {
  const fs::path wrong = scenario("wrong", kLeak +
                                               "<at time=\"1\"><loss of=\"imu\" share=\"0.3\"/>"
                                               "<current x=\"0.1\" y=\"0\"/></at>\n"
                                               "<expect><outcome is=\"success\"/></expect>");
  const fs::path right = scenario("right", "<expect><outcome is=\"success\"/></expect>");
  const fs::path keep = own_folder() / "kept";
  fs::remove_all(keep);
  const Ran ran =
      dive("test " + in_quotes(wrong) + " " + in_quotes(right) + " --keep " + in_quotes(keep));
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.out, HasSubstr("dive explain " + (keep / "wrong.lcmlog").string()));
  EXPECT_FALSE(fs::exists(keep / "right.lcmlog"));
  EXPECT_EQ(dive("replay " + in_quotes(keep / "wrong.lcmlog")).status, 0);
  EXPECT_THAT(dive("explain " + in_quotes(keep / "wrong.lcmlog")).out,
              HasSubstr("water in the hull"));
  EXPECT_EQ(dive("test " + in_quotes(right) + " --keep-all --keep " + in_quotes(keep)).status, 0);
  EXPECT_TRUE(fs::exists(keep / "right.lcmlog"));
}

// Runs a shipped scenario, which must pass, and returns what `explain` says of its log. The log
// must replay.
std::string explained(const std::string& name) {
  const fs::path keep = own_folder() / name;
  fs::remove_all(keep);
  const Ran ran = dive("test --keep-all --keep " + in_quotes(keep) + " " +
                       in_quotes(kShipped / (name + ".xml")));
  EXPECT_EQ(ran.status, 0) << ran.out;
  const std::string log = in_quotes(keep / (name + ".lcmlog"));
  EXPECT_EQ(dive("replay " + log).status, 0);
  return dive("explain " + log).out;
}

// The log contains the visual-inertial estimates, so that a replay needs no cameras.
TEST(ScenarioCommand, AVisualInertialDiveReplays) {
  EXPECT_THAT(explained("cameras_fail_in_turn"), HasSubstr("estimator primitive: the same"));
}

// The scans are not in the log; that an object of the map is gone is.
TEST(ScenarioCommand, ADiveInWhichAMappedObjectGoesReplays) {
  EXPECT_THAT(explained("a_mapped_panel_is_gone"), HasSubstr("'panel/panel/collision' is gone"));
}

TEST(ScenarioCommand, AStepThatNeverHappensIsAFailure) {
  const fs::path path = scenario("late",
                                 "<at state=\"dive.abort_retrace\"><fault name=\"leak\"/></at>\n"
                                 "<expect><outcome is=\"success\"/></expect>");
  const Ran ran = dive("test " + in_quotes(path));
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.out,
              HasSubstr(":2:2: expected this step happens; actual: its trigger never came"));
}

TEST(ScenarioCommand, OneThatIsInvalidDoesNotKeepTheOthersFromBeingDived) {
  const fs::path right = scenario("right", "<expect><outcome is=\"success\"/></expect>");
  const Ran ran =
      dive("test " + in_quotes(kMalformed / "fault_unknown.xml") + " " + in_quotes(right));
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("did you mean 'leak'?"));
  EXPECT_THAT(ran.err, HasSubstr("^"));
  EXPECT_THAT(ran.out, HasSubstr("ok       right"));
  EXPECT_THAT(ran.out, HasSubstr("2 scenario(s): 1 ok, 0 failed, 1 invalid"));
}

TEST(ScenarioCommand, WrongUsageIsTwo) {
  EXPECT_EQ(
      dive("test --disable-scripts --negate " + in_quotes(kShipped / "dart_nominal.xml")).status,
      2);
  EXPECT_EQ(dive("test").status, 2);
  EXPECT_EQ(dive("test nowhere.xml").status, 2);
  EXPECT_EQ(dive("test --keep-all " + in_quotes(kShipped / "dart_nominal.xml")).status, 2);
  const Ran empty = dive("test " + in_quotes(own_folder()));
  EXPECT_EQ(empty.status, 2);
  EXPECT_THAT(empty.err, HasSubstr("holds no scenario"));
}

TEST(ScenarioCommand, TheOutputDoesNotDependOnTheNumberOfJobs) {
  std::string files;
  for (const char* name :
       {"dart_nominal", "hall_nominal", "leak_in_open_water", "return_path_blocked"}) {
    files += fmt::format(" '{}/{}.xml'", kShipped.string(), name);
  }
  const Ran alone = dive("test --jobs 1" + files);
  EXPECT_EQ(alone.status, 0) << alone.out;
  EXPECT_EQ(dive("test --jobs 4" + files).out, alone.out);
}

TEST(ScenarioCommand, WritesJUnitThatCanBeParsed) {
  const fs::path wrong = scenario("wrong", kLeak +
                                               "<description>\"&lt;&amp;\"</description>"
                                               "<expect><outcome is=\"success\"/></expect>");
  const fs::path file = own_folder() / "results.xml";
  const Ran ran =
      dive("test --junit " + in_quotes(file) + " " + in_quotes(wrong) + " " +
           in_quotes(kShipped / "dart_nominal.xml") + " " + in_quotes(kMalformed / "doctype.xml"));
  EXPECT_EQ(ran.status, 2);
  Diagnostics diagnostics;
  const auto report = read_xml(file.string(), XmlLimits{}, diagnostics);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->root.name, "testsuites");
  EXPECT_EQ(report->root.attribute("tests")->value, "3");
  EXPECT_EQ(report->root.attribute("failures")->value, "1");
  EXPECT_EQ(report->root.attribute("errors")->value, "1");
  const XmlElement& suite = report->root.children.at(0);
  ASSERT_EQ(suite.children.size(), 3U);
  EXPECT_THAT(suite.children[0].child("failure")->text, HasSubstr("expected outcome success"));
  EXPECT_TRUE(suite.children[1].children.empty());
  EXPECT_NE(suite.children[2].child("error"), nullptr);
}

TEST(ScenarioCommand, TheUsersQuestionIsAnsweredFirst) {
  EXPECT_THAT(dive("test --help").out, ::testing::StartsWith("Examples:\n  dive test"));
  EXPECT_THAT(dive("tset missions").err, HasSubstr("did you mean 'test'?"));
}

}  // namespace
}  // namespace dive::mission
