// The dive card: how legs and faults are summarised, what the card says compared with what
// `dive check --json` printed, and that it prints on one page whatever the mission.

#include "mission/card/card.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mission/card/abort_table.h"
#include "mission/card/card_legs.h"
#include "mission/card/card_text.h"
#include "mission/card/checklist.h"
#include "mission/report/sha256.h"
#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using testing::content_of;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Ran;

const fs::path kMissions = fs::path(DIVE_SOURCE_DIR) / "missions";

std::string place() {
  std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  std::replace(name.begin(), name.end(), '/', '-');
  return "card-" + name;
}

fs::path folder() {
  fs::path path = fs::path(::testing::TempDir()) / "dive-command" / place();
  fs::create_directories(path);
  return path;
}

Ran dive(const std::string& arguments) { return testing::run_dive(arguments, place()); }

std::string shipped(const std::string& name) { return (kMissions / (name + ".xml")).string(); }

Mission loaded(const std::string& path) {
  Diagnostics diagnostics;
  std::optional<Mission> mission = load_mission(path, diagnostics);
  EXPECT_TRUE(mission) << path;
  return std::move(*mission);
}

TEST(CardText, TellsTimesAsAClockDoes) {
  EXPECT_EQ(clock_text(0.4), "0:00");
  EXPECT_EQ(clock_text(59.6), "1:00");
  EXPECT_EQ(clock_text(3599.6), "1:00:00");
  EXPECT_EQ(clock_text(3723.0), "1:02:03");
}

TEST(CardText, CutsBetweenCharacters) {
  EXPECT_EQ(cut_text("wreck", 5), "wreck");
  EXPECT_EQ(cut_text("wreck", 4), "wrec\u2026");
  EXPECT_EQ(cut_text("gr\u00fcn", 3), "gr\u2026") << "the third byte is within a character";
}

/// A report with one leg of 10 m and 25 s for each state.
CheckReport report_of(const std::vector<std::string>& states) {
  CheckReport report;
  for (std::size_t i = 0; i < states.size(); ++i) {
    PlannedRouteLeg leg;
    leg.state = states[i];
    leg.goal = fmt::format("goal-{}", i + 1);
    leg.plan.length_m = 10.0;
    leg.plan.clearance_m = 5.0 - 0.1 * static_cast<double>(i);
    leg.margin.margin_sigma = i == 3 ? 6.0 : 9.0;
    report.legs.push_back(leg);
    const double begins_s = 25.0 * static_cast<double>(i);
    report.times.legs.push_back({begins_s, {begins_s}, begins_s + 25.0, begins_s + 25.0});
    report.exit_path.legs.push_back({i == 4 ? 8.0 : 0.0, i == 4 ? 40.0 : 10.0, i != 4, i == 4});
    report.budget.turning_points.push_back({600.0 - report.exit_path.legs.back().longest_s, 0.3});
  }
  return report;
}

TEST(CardLegs, KeepsEveryLegOfAShortRoute) {
  const std::vector<CardLeg> rows = card_legs(report_of({"a", "a", "b"}));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[1].first, 2);
  EXPECT_EQ(rows[1].last, 2);
}

TEST(CardLegs, JoinsTheLegsOfAStateWithTheWorstOfTheirValues) {
  const std::vector<CardLeg> rows =
      card_legs(report_of({"a", "b", "b", "b", "b", "b", "b", "b", "b", "b", "b", "c"}));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[1].first, 2);
  EXPECT_EQ(rows[1].last, 11);
  EXPECT_EQ(rows[1].from, "goal-2");
  EXPECT_EQ(rows[1].to, "goal-11");
  EXPECT_DOUBLE_EQ(rows[1].length_m, 100.0);
  EXPECT_DOUBLE_EQ(rows[1].arrives_s, 275.0);
  EXPECT_DOUBLE_EQ(rows[1].clearance_m, 4.0);
  EXPECT_DOUBLE_EQ(rows[1].margin_sigma, 6.0);
  EXPECT_DOUBLE_EQ(rows[1].exit.longest_s, 40.0);
  EXPECT_DOUBLE_EQ(rows[1].exit.longest_m, 8.0);
  EXPECT_TRUE(rows[1].exit.has_overhead);
  EXPECT_DOUBLE_EQ(rows[1].turn.latest_s, 560.0);
}

TEST(CardLegs, LeavesNoLegOutOfALongRoute) {
  std::vector<std::string> states;
  for (int i = 0; i < 137; ++i) states.push_back(fmt::format("state-{}", i));
  const std::vector<CardLeg> rows = card_legs(report_of(states));
  EXPECT_LE(rows.size(), kMaxLegRows);
  int next = 1;
  for (const CardLeg& row : rows) {
    EXPECT_EQ(row.first, next);
    next = row.last + 1;
  }
  EXPECT_EQ(next, 138);
}

std::vector<std::string> faults_of(const Mission& mission) {
  std::vector<std::string> faults;
  for (const AbortRow& row : abort_table(mission)) {
    faults.insert(faults.end(), row.faults.begin(), row.faults.end());
  }
  return faults;
}

AbortRow row_with(const std::vector<AbortRow>& rows, const std::string& fault) {
  for (const AbortRow& row : rows) {
    if (std::ranges::find(row.faults, fault) != row.faults.end()) return row;
  }
  ADD_FAILURE() << "no row has " << fault;
  return {};
}

TEST(AbortTable, SaysOfEveryFailsafeWhatItDoes) {
  const Mission mission = loaded(shipped("penetration"));
  EXPECT_EQ(faults_of(mission).size(), behaviors::kFailsafeCount);
  const std::vector<AbortRow> rows = abort_table(mission);
  ASSERT_GE(rows.size(), 4U);
  EXPECT_THAT(row_with(rows, "the exit path is blocked").under_overhead, HasSubstr("straight up"));
  EXPECT_THAT(row_with(rows, "error in the program").under_overhead, HasSubstr("exit path"));
  const AbortRow low = row_with(rows, "charge below 35 %");
  EXPECT_EQ(low.in_open_water, "straight up");
  EXPECT_THAT(low.under_overhead, HasSubstr("back along its trail"));
  EXPECT_THAT(low.faults, Contains("deeper than 14.8 m"));
  EXPECT_EQ(rows.back().in_open_water, "not watched");
  EXPECT_THAT(rows.back().faults, Contains(HasSubstr("topside silent")));
}

TEST(AbortTable, FollowsTheMissionAndLeavesOutWhatCannotHappen) {
  Mission mission = loaded(shipped("penetration"));
  mission.failsafes.policy(behaviors::FailsafeKind::kCommsLost).rung = behaviors::Rung::kRetrace;
  mission.allows_fixes = false;
  const std::vector<AbortRow> rows = abort_table(mission);
  EXPECT_EQ(row_with(rows, "topside silent for 60 s").in_open_water, "waits 1 min, then up");
  EXPECT_THAT(faults_of(mission), Not(Contains(HasSubstr("range data"))));
  EXPECT_THAT(faults_of(mission), Not(Contains(HasSubstr("another place"))));
}

TEST(StateReactions, SaysWhatAStateDoesByItself) {
  CheckReport report = report_of({"wreck-entry", "wreck-inside", "wreck-inside", "wreck-exit"});
  const std::vector<StateReaction> reactions =
      state_reactions(loaded(shipped("penetration")), report);
  ASSERT_EQ(reactions.size(), 3U);
  EXPECT_EQ(reactions[0].at_timeout, "6:40 \u2192 back") << "that of the state around it";
  EXPECT_THAT(reactions[1].otherwise, HasSubstr("penetration > 25 m"));
  EXPECT_THAT(reactions[1].otherwise, HasSubstr("\u2192 wreck-exit"));
  EXPECT_EQ(reactions[1].without_path, "\u2192 wreck-exit");
  EXPECT_EQ(reactions[2].without_path, "\u2192 wreck-retrace");
}

TEST(Checklist, AsksForWhatTheMissionNeeds) {
  const CheckReport report = report_of({"swim"});
  const std::vector<std::string> seen = checklist(loaded(shipped("wreck_visual_inertial")), report);
  EXPECT_THAT(seen, Contains(HasSubstr("Front cameras")));
  EXPECT_THAT(seen, Not(Contains(HasSubstr("Range camera"))));
  const std::vector<std::string> mapped = checklist(loaded(shipped("window")), report);
  EXPECT_THAT(mapped, Not(Contains(HasSubstr("Front cameras"))));
  EXPECT_THAT(mapped, Contains(HasSubstr("Range camera")));
  EXPECT_THAT(mapped, Contains(HasSubstr("x -4 m east, y -2 m north (within 0.2 m), 3 m deep")));
}

/// What `dive check ARGUMENTS --card` wrote and printed.
struct Carded {
  json check;
  std::string card;
};

Carded card_of(const std::string& arguments) {
  const Ran ran = dive("check " + arguments + " --card card.html --force --json");
  EXPECT_EQ(ran.status, 0) << ran.out << ran.err;
  return {json::parse(ran.out), content_of(folder() / "card.html")};
}

TEST(Card, SaysWhatTheCheckFound) {
  const std::string path = shipped("window");
  const Carded carded = card_of("'" + path + "' --dives 3");
  EXPECT_EQ(carded.check.at("card"), "card.html");
  const json& dives = carded.check.at("dives");
  EXPECT_THAT(carded.card,
              HasSubstr(fmt::format("<b>0 of 3</b> dives collided: at most <b>{:.1f} "
                                    "%</b>",
                                    100.0 * dives.at("collision_bound_95").get<double>())));
  EXPECT_THAT(carded.card, HasSubstr(fmt::format("Clearance <b>{:.2f} m</b>",
                                                 dives.at("clearance_m").at("p05").get<double>())));
  for (const json& plan : carded.check.at("plans")) {
    const json& out = plan.at("way_out");
    EXPECT_THAT(carded.card, HasSubstr(plan.at("goal").get<std::string>()));
    EXPECT_THAT(carded.card,
                HasSubstr(fmt::format("{:.2f} m", plan.at("clearance_m").get<double>())));
    EXPECT_THAT(carded.card, HasSubstr(clock_text(out.at("latest_s").get<double>())));
    EXPECT_NEAR(out.at("latest_s").get<double>() + out.at("duration_s").get<double>(), 600.0, 1e-9);
    EXPECT_GT(out.at("least_battery_fraction").get<double>(), 0.3);
  }
  EXPECT_THAT(carded.card, HasSubstr(sha256(content_of(path))));
  EXPECT_THAT(carded.card, HasSubstr(sha256(content_of(kMissions / "maps/window.sdf"))));
  EXPECT_THAT(carded.card, Not(HasSubstr("<script")));
  EXPECT_THAT(carded.card, HasSubstr("default-src 'none'"));
}

TEST(Card, TheLongestWayOutIsThatOfTheCheck) {
  const Carded carded = card_of("'" + shipped("penetration") + "' --static");
  double longest_s = 0.0;
  for (const json& plan : carded.check.at("plans")) {
    longest_s = std::max(longest_s, plan.at("way_out").at("duration_s").get<double>());
  }
  EXPECT_DOUBLE_EQ(longest_s, carded.check.at("exit_path").at("longest_s").get<double>());
  EXPECT_THAT(carded.card, HasSubstr("<b>None.</b> Only plans and budgets were checked."));
}

TEST(Card, IsNotWrittenForAMissionThatIsNotReady) {
  std::string mission = content_of(kMissions / "scenarios/missions/dart.xml");
  const std::size_t at = mission.find("mission_timeout=\"120\"");
  ASSERT_NE(at, std::string::npos);
  mission.replace(at, 21, "mission_timeout=\"20\"");
  std::ofstream(folder() / "m.xml") << mission;
  fs::create_directories(folder() / "maps");
  fs::copy_file(kMissions / "scenarios/missions/maps/bay.sdf", folder() / "maps/bay.sdf",
                fs::copy_options::overwrite_existing);
  fs::remove(folder() / "card.html");
  const Ran ran = dive("check m.xml --static --card card.html");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("card.html: no card is written"));
  EXPECT_FALSE(fs::exists(folder() / "card.html"));
  std::ofstream(folder() / "card.html") << "of yesterday";
  EXPECT_EQ(dive("check m.xml --static --card card.html --force").status, 2);
  EXPECT_EQ(content_of(folder() / "card.html"), "of yesterday");
}

/// 40 states with 3 goals each, names as long as they may be, every failsafe with a limit, and more
/// warnings than have room.
void write_longest_mission() {
  fs::create_directories(folder() / "maps");
  fs::copy_file(kMissions / "scenarios/missions/maps/bay.sdf", folder() / "maps/bay.sdf",
                fs::copy_options::overwrite_existing);
  std::string states;
  const auto name = [](const std::string& what, int i) {
    return fmt::format("{}{:W>{}}", what, i, 40 - what.size());
  };
  constexpr int kStates = 40;
  for (int i = 0; i < kStates; ++i) {
    const std::string id = name("state_", i);
    const std::string next = i + 1 < kStates ? name("state_", i + 1) : "up";
    states +=
        fmt::format("<goal_sequence id=\"{}\" timeout=\"900\" on_timeout=\"{}\">\n", id, next);
    for (int k = 0; k < 3; ++k) {
      states += fmt::format(
          "<goal id=\"{}\" x=\"{}\" y=\"{}\" z=\"{}\" z_units=\"DEPTH\" capture_radius=\"0.5\"/>\n",
          name("goal_", 3 * i + k), 2 * (i % 9), 3 * (k % 3), 3 + i % 3);
    }
    states += fmt::format("<transition event=\"done.state.{}\" target=\"{}\"/>\n", id, next);
    states += "<transition event=\"failsafe.temperature failsafe.leak\" target=\"up\"/>\n";
    states +=
        fmt::format("<transition event=\"plan.failed.{}\" target=\"up\"/></goal_sequence>\n", id);
  }
  std::string text = content_of(kMissions / "scenarios/missions/dart.xml");
  const std::size_t begin = text.find("<states");
  text = text.substr(0, begin) + "<states initial=\"" + name("state_", 0) + "\">\n" + states +
         "<surface id=\"up\"><transition event=\"done.state.up\" target=\"surfaced\"/></surface>\n"
         "<final id=\"surfaced\"/></states></mission>\n";
  const auto replace = [&](const std::string& what, const std::string& by) {
    const std::size_t at = text.find(what);
    ASSERT_NE(at, std::string::npos) << what;
    text.replace(at, what.size(), by);
  };
  replace("mission_timeout=\"120\"", "mission_timeout=\"2050\"");
  replace("battery_reserve=\"0.3\"", "battery_reserve=\"0.3\" ");
  replace("East, north, and up.", "&lt;/p&gt;&lt;b&gt;" + std::string(60, 'W') + " " +
                                      std::string(60, 'W') + " " + std::string(60, 'W'));
  std::ofstream(folder() / "longest.xml") << text;
}

/// Pages of a PDF as Chromium writes it.
int pages_of(const std::string& pdf) {
  const std::string page = "/Type /Page";
  int pages = 0;
  for (std::size_t at = pdf.find(page); at != std::string::npos; at = pdf.find(page, at + 1)) {
    if (pdf[at + page.size()] != 's') ++pages;
  }
  return pages;
}

class PrintedCard : public ::testing::TestWithParam<const char*> {};

TEST_P(PrintedCard, IsOnePage) {
  if (std::system("command -v chromium >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "chromium is not installed";
  }
  std::string mission = shipped(GetParam());
  if (GetParam() == std::string("longest")) {
    write_longest_mission();
    mission = (folder() / "longest.xml").string();
  }
  const Carded carded = card_of("'" + mission + "' --static");
  EXPECT_THAT(carded.card, Not(HasSubstr("</p><b>WW")));
  const std::string command =
      "cd '" + folder().string() + "' && HOME='" + folder().string() +
      "' timeout 120 chromium --headless=new --no-sandbox --user-data-dir=profile "
      "--disable-dev-shm-usage --no-pdf-header-footer --print-to-pdf=card.pdf 'file://" +
      (folder() / "card.html").string() + "' >chromium.txt 2>&1 </dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0) << content_of(folder() / "chromium.txt");
  const std::string pdf = content_of(folder() / "card.pdf");
  ASSERT_THAT(pdf.substr(0, 4), "%PDF");
  EXPECT_EQ(pages_of(pdf), 1);
}

INSTANTIATE_TEST_SUITE_P(Of, PrintedCard,
                         ::testing::Values("window", "survey", "penetration", "transect", "blocks",
                                           "wreck_unknown", "longest"),
                         [](const auto& each) { return std::string(each.param); });

}  // namespace
}  // namespace dive::mission
