// What two missions, plans or logs mean differently.

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mission/diff/document_difference.h"
#include "mission/diff/plan_difference.h"
#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using testing::content_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::own_folder;
using testing::Ran;
using testing::run_here;

// ----------------------------------------------------------------------------- documents

std::vector<std::string> differences(const std::string& a, const std::string& b) {
  Diagnostics diagnostics;
  const auto one = parse_xml(SourceText("a", a), {}, diagnostics);
  const auto other = parse_xml(SourceText("b", b), {}, diagnostics);
  EXPECT_TRUE(one && other);
  std::vector<std::string> list;
  for (const auto& [what, first, second] : document_differences(one->root, other->root)) {
    list.push_back(fmt::format("{}: {}|{}", what, first, second));
  }
  return list;
}

TEST(DocumentDifference, IsNoneBetweenWaysToWriteTheSame) {
  const std::string written =
      "<m><limits depth='6.50' speed='0.4'/><state id='a' x='1 2 3'>text</state><state "
      "id='b'/></m>";
  const std::string otherwise =
      "<!-- why -->\n<m>\n  <state x='1.0\t2 3e0' id='a'>\n text\n</state>\n  <state "
      "id='b'></state>\n"
      "  <limits speed='.4' depth='6.5'/>\n</m>\n";
  EXPECT_THAT(differences(written, otherwise), IsEmpty());
}

TEST(DocumentDifference, NamesWhatDiffersByItsPath) {
  EXPECT_THAT(differences("<m><limits depth='6'/><s id='a'><t x='1'/></s></m>",
                          "<m><limits depth='7'/><s id='a'><t y='1'/></s></m>"),
              ElementsAre("limits/@depth: 6|7", "s[a]/t/@x: 1|", "s[a]/t/@y: |1"));
  EXPECT_THAT(differences("<m><s id='a'/><s id='b'/></m>", "<m><s id='b'/><s id='c'/></m>"),
              ElementsAre("s[a]: is there|", "s[c]: |is there"));
  EXPECT_THAT(differences("<m><s id='a'/><s id='b'/></m>", "<m><s id='b'/><s id='a'/></m>"),
              ElementsAre("order: s[a]|s[b]"))
      << "the order of states counts";
  EXPECT_THAT(differences("<m><log text='a'/><log text='b'/></m>", "<m><log text='a'/></m>"),
              ElementsAre("log (2): is there|"));
  EXPECT_THAT(differences("<m>one</m>", "<m>other</m>"), ElementsAre("text(): one|other"));
  EXPECT_THAT(differences("<m/>", "<n/>"), ElementsAre("root: m|n"));
}

// --------------------------------------------------------------------------------- plans

Json plan_of(double clearance_m, double x) {
  return Json::parse(fmt::format(
      R"({{"ok": true, "diagnostics": [], "budget": {{"duration_s": 100}}, "plans": [
           {{"state": "s", "goal": "g", "status": "success", "clearance_m": {}, "time_ms": {},
             "waypoints": [[0, 0, -2, 0, 0, 0, 1], [{}, 0, -2, 0, 0, 0, 1]]}}]}})",
      clearance_m, 100.0 * clearance_m, x));
}

TEST(PlanDifference, IsOfWhatThePlanSaysNotOfItsTimings) {
  Json slower = plan_of(0.6, 5);
  slower["plans"][0]["time_ms"] = 1.0;
  EXPECT_FALSE(compare_plans(plan_of(0.6, 5), slower).differs());

  const PlanComparison changed = compare_plans(plan_of(0.6, 5), plan_of(0.7, 8));
  EXPECT_TRUE(changed.differs());
  ASSERT_EQ(changed.legs.size(), 1U);
  EXPECT_EQ(changed.legs[0].quantities[0].name, "clearance");
  EXPECT_EQ(changed.legs[0].quantities[0].b, 0.7);
  EXPECT_DOUBLE_EQ(changed.legs[0].apart_m.value(), 3.0);
}

TEST(PlanDifference, ListsLegsAndFindingsOfOneOnly) {
  Json other = plan_of(0.6, 5);
  other["ok"] = false;
  other["plans"][0]["goal"] = "h";
  other["diagnostics"] = {{{"severity", "error"}, {"code", "CHK-TIME"}, {"message", "too long"}}};
  other.erase("budget");
  const PlanComparison comparison = compare_plans(plan_of(0.6, 5), other);
  ASSERT_EQ(comparison.legs.size(), 2U);
  EXPECT_FALSE(comparison.legs[0].status_b);
  EXPECT_FALSE(comparison.legs[1].status_a);
  ASSERT_EQ(comparison.findings.size(), 2U);
  EXPECT_EQ(comparison.findings[0].what, "ready to dive");
  EXPECT_EQ(comparison.findings[1].what, "error CHK-TIME");
  EXPECT_FALSE(comparison.budget.at(0).differs()) << "what one did not compute is no difference";
}

TEST(PlanDifference, RefusesWhatIsNoPlan) {
  for (const char* text : {"", "{", "[]", "{}", "{\"plans\": 3}", "{\"plans\": [3]}",
                           "{\"plans\": [{\"status\": 3}]}"}) {
    EXPECT_FALSE(parse_plan(text)) << text;
  }
  const auto path = parse_plan(R"({"status": "success", "clearance_m": 0.6})");
  ASSERT_TRUE(path);
  EXPECT_FALSE(compare_plans(*path, *path).differs());
}

// -------------------------------------------------------------------------------- command

std::string shipped(const std::string& name) {
  return fmt::format("{}/missions/{}", DIVE_SOURCE_DIR, name);
}

/// Copies pool1 and its map with `from` replaced by `to`.
void write_changed(const std::string& name, const std::string& from, const std::string& to) {
  fs::create_directories(own_folder() / "maps");
  fs::copy_file(shipped("maps/pool1.sdf"), own_folder() / "maps/pool1.sdf",
                fs::copy_options::overwrite_existing);
  std::string text = content_of(shipped("pool1.xml"));
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos);
  std::ofstream(own_folder() / name) << text.replace(at, from.size(), to);
}

TEST(DiffCommand, OfAMissionAndItsReformattedCopyIsEqual) {
  write_changed("same.xml", "<limits", "\n<!-- a comment -->\n   <limits");
  const Ran same = run_here("diff " + shipped("pool1.xml") + " same.xml");
  EXPECT_EQ(same.status, 0) << same.out << same.err;
  ASSERT_EQ(run_here("check --static same.xml --bundle same.bundle").status, 0);
  const Ran bundle = run_here("diff " + shipped("pool1.xml") + " same.bundle --json");
  EXPECT_EQ(bundle.status, 0) << bundle.out;
  EXPECT_TRUE(Json::parse(bundle.out).at("equal").get<bool>());
}

TEST(DiffCommand, OfTwoMissionsShowsLegsAndBudgets) {
  write_changed("slower.xml", "speed=\"0.4\"", "speed=\"0.3\"");
  const Ran ran = run_here("diff " + shipped("pool1.xml") + " slower.xml");
  EXPECT_EQ(ran.status, 1) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("vehicle/@speed: 0.4 | 0.3"));
  EXPECT_THAT(ran.out, HasSubstr("* duration"));
  const Json json =
      Json::parse(run_here("diff " + shipped("pool1.xml") + " slower.xml --json").out);
  EXPECT_FALSE(json.at("equal").get<bool>());
  EXPECT_EQ(json.at("mission").size(), 1U);
  EXPECT_TRUE(json.at("map").empty());
}

TEST(DiffCommand, OfTwoPlansComparesTheirPaths) {
  const std::string plan =
      "plan --map " + shipped("maps/window.sdf") + " --start -1,-2,-4 --json --goal ";
  std::ofstream(own_folder() / "a.json") << run_here(plan + "-4,-2,-3").out;
  std::ofstream(own_folder() / "b.json") << run_here(plan + "-4,-2,-2.5").out;
  EXPECT_EQ(run_here("diff a.json a.json").status, 0);
  const Ran changed = run_here("diff a.json b.json");
  EXPECT_EQ(changed.status, 1);
  EXPECT_THAT(changed.out, HasSubstr("m apart"));
}

TEST(DiffCommand, OfTwoLogsNamesTheFirstDecisionThatDiffersAndTheInputBeforeIt) {
  const std::string run = "run " + shipped("pool1.xml") + " --seed 3 --log ";
  run_here(run + "plain.lcmlog");
  run_here(run + "again.lcmlog");
  run_here(run + "leak.lcmlog --leak-at 20");
  EXPECT_EQ(run_here("diff plain.lcmlog again.lcmlog").status, 0);

  const Ran ran = run_here("diff plain.lcmlog leak.lcmlog --json");
  EXPECT_EQ(ran.status, 1) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_TRUE(json.at("header").empty());
  const Json& decision = json.at("decision").at("b");
  EXPECT_EQ(decision.at("kind"), "failsafe");
  EXPECT_THAT(decision.at("what").get<std::string>(), HasSubstr("leak"));
  const double leak_s = decision.at("t").get<double>();
  EXPECT_NEAR(leak_s, 20.0, 2.0);
  ASSERT_FALSE(json.at("inputs").empty());
  const Json& input = json.at("inputs").at(0);
  EXPECT_EQ(input.at("input"), "DIVE_IN_HEALTH");
  EXPECT_THAT(input.at("b").get<std::string>(), HasSubstr("leak"));
  EXPECT_LE(input.at("t").get<double>(), leak_s);
  EXPECT_THAT(json.at("output").get<std::string>(), HasSubstr("A "));
  EXPECT_THAT(run_here("diff plain.lcmlog leak.lcmlog").out,
              HasSubstr("the first decision that differs, after"));
}

// Another seed: other sensor errors from the first tick on, and the same decisions.
TEST(DiffCommand, OfTwoDivesThatDecideTheSameSaysSo) {
  const std::string run = "run " + shipped("pool1.xml") + " --log ";
  run_here(run + "one.lcmlog --seed 1");
  run_here(run + "two.lcmlog --seed 2");
  const Ran ran = run_here("diff one.lcmlog two.lcmlog");
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.out, HasSubstr("seed: 1 | 2"));
  EXPECT_THAT(ran.out, HasSubstr("the same "));
}

TEST(DiffCommand, RefusesFilesOfDifferentKinds) {
  run_here("run " + shipped("pool1.xml") + " --log pool1.lcmlog");
  const Ran kinds = run_here("diff " + shipped("pool1.xml") + " pool1.lcmlog");
  EXPECT_EQ(kinds.status, 2);
  EXPECT_THAT(kinds.err, HasSubstr("is a mission, and pool1.lcmlog is a log"));
  EXPECT_EQ(run_here("diff pool1.lcmlog nowhere.lcmlog").status, 2);
  EXPECT_THAT(run_here("diff pool1.lcmlog nowhere.lcmlog").err,
              HasSubstr("nowhere.lcmlog: no such"));
  EXPECT_THAT(run_here("diff " + shipped("maps/pool1.sdf") + " pool1.lcmlog").err,
              HasSubstr("this is a map"));
  write_changed("bad.xml", "speed=\"0.4\"", "speed=\"fast\"");
  EXPECT_EQ(run_here("diff " + shipped("pool1.xml") + " bad.xml").status, 2);
  std::ofstream(own_folder() / "odd.json") << "{\"plans\": 3}";
  EXPECT_EQ(run_here("diff odd.json odd.json").status, 2);
}

}  // namespace
}  // namespace dive::mission
