// The declared current in mission files: constant, tide tables, and what is wrong with them.

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "mission/document/mission.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

using Eigen::Vector2d;

constexpr const char* kTide =
    "time,speed,towards_deg\n"
    "09:50,0.10,90\n"
    "# the turn of the tide\n"
    "\n"
    "10:10, 0.00 ,90\n"
    "10:30,0.20,270\n";

std::string rendered(const Diagnostics& diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics.list()) text += render(diagnostic, false);
  return text;
}

// A mission in a folder of its own, whose fourth line is `current`.
class CurrentFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / fmt::format("current_{}", test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "maps");
    fs::copy_file(DIVE_SOURCE_DIR "/missions/scenarios/missions/maps/bay.sdf",
                  folder_ / "maps/bay.sdf");
  }

  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  std::optional<Mission> load(const std::string& current) {
    write("mission.xml",
          fmt::format(
              "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">\n"
              "<vehicle model=\"aqua2\" speed=\"0.4\"/><map file=\"maps/bay.sdf\"/>\n"
              "<start x=\"0\" y=\"0\" z=\"2\" z_units=\"DEPTH\" heading_deg=\"90\"/>\n"
              "{}\n"
              "<limits max_depth=\"6\" min_altitude=\"1\" clearance=\"0.6\" mission_timeout=\"120\""
              " battery_reserve=\"0.3\"/>\n"
              "<states initial=\"a\"><goto id=\"a\" x=\"6\" y=\"0\" z=\"3\" z_units=\"DEPTH\" "
              "timeout=\"60\" on_timeout=\"up\"><transition event=\"done.state.a\" "
              "target=\"up\"/></goto><surface id=\"up\"><transition event=\"done.state.up\" "
              "target=\"end\"/></surface><final id=\"end\"/></states></mission>",
              current));
    diagnostics_ = {};
    return load_mission((folder_ / "mission.xml").string(), diagnostics_);
  }

  // The one error that this current gives.
  Diagnostic error_of(const std::string& current) {
    EXPECT_FALSE(load(current)) << current;
    EXPECT_EQ(diagnostics_.list().size(), 1U) << rendered(diagnostics_);
    return diagnostics_.list().empty() ? Diagnostic{} : diagnostics_.list().front();
  }

  fs::path folder_;
  Diagnostics diagnostics_;
};

TEST_F(CurrentFile, AConstantFlowsTowardsItsHeading) {
  const auto mission = load("<current speed=\"0.05\" towards_deg=\"180\" sigma=\"0.02\"/>");
  ASSERT_TRUE(mission) << rendered(diagnostics_);
  EXPECT_LT((mission->current.value.at(33.0) - Vector2d(0.0, -0.05)).norm(), 1e-12);
  EXPECT_EQ(mission->priors.current, 0.02);
  EXPECT_EQ(mission->current.span.line, 4);
}

TEST_F(CurrentFile, OfASigmaAloneIsStill) {
  const auto mission = load("<current sigma=\"0.02\"/>");
  ASSERT_TRUE(mission) << rendered(diagnostics_);
  EXPECT_TRUE(mission->current.value.is_still());
}

TEST_F(CurrentFile, ATableIsCountedFromTheStart) {
  write("tide.csv", kTide);
  const auto mission = load("<current table=\"tide.csv\" start=\"10:00\" sigma=\"0.01\"/>");
  ASSERT_TRUE(mission) << rendered(diagnostics_);
  const DeclaredCurrent& current = mission->current.value;
  EXPECT_LT((current.at(0.0) - Vector2d(0.05, 0.0)).norm(), 1e-12) << "half of the way to the turn";
  EXPECT_LT(current.at(600.0).norm(), 1e-12);
  EXPECT_LT((current.at(1200.0) - Vector2d(-0.1, 0.0)).norm(), 1e-12);
  EXPECT_TRUE(current.covers(-600.0, 1800.0));
  EXPECT_FALSE(current.covers(0.0, 1801.0));
  EXPECT_EQ(mission->priors.current, 0.01);
}

TEST_F(CurrentFile, ATableBeyondMidnightGoesOnWithTwentyFour) {
  write("tide.csv", "time,speed,towards_deg\r\n23:50,0.1,0\r\n24:10,0.3,0\r\n");
  const auto mission = load("<current start=\"23:50\" table=\"tide.csv\"/>");
  ASSERT_TRUE(mission) << rendered(diagnostics_);
  EXPECT_LT((mission->current.value.at(600.0) - Vector2d(0.0, 0.2)).norm(), 1e-12);
}

// What is logged is the expanded text: it must stand without the file.
TEST_F(CurrentFile, TheExpandedMissionNeedsNoTable) {
  write("tide.csv", kTide);
  const auto mission = load("<current sigma=\"0.01\" table='tide.csv'\n start=\"10:00\" />");
  ASSERT_TRUE(mission) << rendered(diagnostics_);
  fs::remove(folder_ / "tide.csv");
  const auto again =
      parse_mission({"log", mission->source.content()}, diagnostics_, MapFile::kNotNeeded);
  ASSERT_TRUE(again) << rendered(diagnostics_);
  EXPECT_EQ(again->priors.current, 0.01);
  for (const double t : {-1000.0, 0.0, 333.0, 1700.0, 9000.0}) {
    EXPECT_EQ(again->current.value.at(t), mission->current.value.at(t)) << t;
  }
  EXPECT_EQ(mission->source.origin(mission->limits.clearance.span.line).line, 6)
      << "the lines after the table keep their origin";
  const auto with_file =
      parse_mission({"log",
                     "<mission xmlns=\"urn:dive:mission:1\" id=\"m\"><current table=\"tide.csv\"/>"
                     "</mission>"},
                    diagnostics_, MapFile::kNotNeeded);
  EXPECT_FALSE(with_file) << "a log reads no file";
}

TEST_F(CurrentFile, OfAFragmentIsFoundBesideTheFragment) {
  fs::create_directories(folder_ / "parts");
  write("parts/tide.csv", kTide);
  write("parts/water.xml",
        "<fragment xmlns=\"urn:dive:mission:1\"><m:current xmlns:m=\"urn:dive:mission:1\" "
        "start=\"10:00\" table=\"tide.csv\"/></fragment>");
  const auto mission = load("<include href=\"parts/water.xml\"/>");
  ASSERT_TRUE(mission) << rendered(diagnostics_);
  EXPECT_LT((mission->current.value.at(0.0) - Vector2d(0.05, 0.0)).norm(), 1e-12);
}

struct Malformed {
  const char* name;
  std::string table;
  int line;
  int column;
  const char* phrase;
};

class MalformedTable : public CurrentFile, public ::testing::WithParamInterface<Malformed> {};

TEST_P(MalformedTable, IsRefusedWithItsLine) {
  const Malformed& malformed = GetParam();
  write("tide.csv", malformed.table);
  const Diagnostic error = error_of("<current table=\"tide.csv\" start=\"10:00\"/>");
  EXPECT_EQ(error.code, "MIS-CURRENT-TABLE");
  EXPECT_EQ(fs::path(error.file).filename(), "tide.csv");
  EXPECT_EQ(error.span.line, malformed.line);
  EXPECT_EQ(error.span.column, malformed.column);
  EXPECT_NE(error.message.find(malformed.phrase), std::string::npos) << error.message;
  EXPECT_FALSE(error.hint.empty());
  EXPECT_NE(error.included_from.find("mission.xml:4"), std::string::npos) << error.included_from;
}

const std::string kHeader = "time,speed,towards_deg\n";

std::string long_table(int rows) {
  std::string text = kHeader;
  for (int i = 0; i < rows; ++i) text += fmt::format("{:02}:{:02},0.1,90\n", i / 60, i % 60);
  return text;
}

INSTANTIATE_TEST_SUITE_P(
    All, MalformedTable,
    ::testing::Values(
        Malformed{"empty", "", 1, 1, "has 0 rows"},
        Malformed{"one_row", kHeader + "10:00,0.1,90", 2, 1, "has 1 row of"},
        Malformed{"no_header", "10:00,0.1,90\n11:00,0.1,90\n", 1, 1, "must name the columns"},
        Malformed{"other_order", "time,towards_deg,speed\n10:00,90,0.1\n", 1, 1,
                  "name the columns"},
        Malformed{"semicolons", "time;speed;towards_deg\n10:00;0,1;90\n", 1, 1, "name the columns"},
        Malformed{"decimal_comma", kHeader + "10:00,0,1,90\n11:00,0.1,90\n", 2, 1, "has 4 values"},
        Malformed{"value_missing", kHeader + "10:00,0.1\n11:00,0.1,90\n", 2, 1, "has 2 values"},
        Malformed{"no_time", kHeader + "10.00,0.1,90\n11:00,0.1,90\n", 2, 1, "not a time of day"},
        Malformed{"minute_60", kHeader + "10:60,0.1,90\n11:00,0.1,90\n", 2, 1, "not a time of day"},
        Malformed{"hour_48", kHeader + "10:00,0.1,90\n48:00,0.1,90\n", 3, 1, "not a time of day"},
        Malformed{"back_in_time", kHeader + "23:50,0.1,90\n00:10,0.1,90\n", 3, 1, "not later"},
        Malformed{"same_time", kHeader + "10:00,0.1,90\n10:00,0.1,90\n", 3, 1, "not later"},
        Malformed{"speed_word", kHeader + "10:00,fast,90\n11:00,0.1,90\n", 2, 7, "not a speed"},
        Malformed{"speed_negative", kHeader + "10:00,-0.1,90\n11:00,0.1,90\n", 2, 7, "not a speed"},
        Malformed{"speed_nan", kHeader + "10:00,nan,90\n11:00,0.1,90\n", 2, 7, "not a speed"},
        Malformed{"speed_exponent", kHeader + "10:00,1e-1,90\n11:00,0.1,90\n", 2, 7, "not a speed"},
        Malformed{"speed_4", kHeader + "10:00,4,90\n11:00,0.1,90\n", 2, 7, "not a speed"},
        Malformed{"heading_361", kHeader + "10:00,0.1,90\n11:00,0.1,361\n", 3, 11, "compass"},
        Malformed{"markup", kHeader + "10:00,0.1,\"/><x\n11:00,0.1,90\n", 2, 11, "compass"},
        Malformed{"too_long", long_table(1001), 1002, 1, "more than 1000 rows"}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST_F(CurrentFile, EveryMalformedLineIsReported) {
  write("tide.csv", kHeader + "10:00,0.1,90\nxx,0.1,90\n11:00,x,y\n12:00,0.1,90\n");
  EXPECT_FALSE(load("<current table=\"tide.csv\" start=\"10:00\"/>"));
  ASSERT_EQ(diagnostics_.list().size(), 3U) << rendered(diagnostics_);
}

TEST_F(CurrentFile, ATableLiesBesideTheMission) {
  EXPECT_NE(error_of("<current table=\"tied.csv\" start=\"10:00\"/>").message.find("no file"),
            std::string::npos);
  EXPECT_EQ(diagnostics_.list().front().code, "MIS-CURRENT-TABLE");
  EXPECT_EQ(diagnostics_.list().front().span.line, 4);
  std::ofstream(folder_.parent_path() / "outside.csv") << kTide;
  EXPECT_NE(
      error_of("<current table=\"../outside.csv\" start=\"10:00\"/>").message.find("outside of"),
      std::string::npos);
  EXPECT_NE(error_of("<current table=\"/etc/passwd\" start=\"10:00\"/>").message.find("absolute"),
            std::string::npos);
  fs::create_symlink("/etc/passwd", folder_ / "link.csv");
  EXPECT_NE(error_of("<current table=\"link.csv\" start=\"10:00\"/>").message.find("outside of"),
            std::string::npos);
  write("huge.csv", long_table(3) + std::string(70'000, '#'));
  EXPECT_NE(error_of("<current table=\"huge.csv\" start=\"10:00\"/>").message.find("larger than"),
            std::string::npos);
}

TEST_F(CurrentFile, IsEitherConstantOrATable) {
  write("tide.csv", kTide);
  const auto expect = [&](const std::string& current, const std::string& code,
                          const std::string& phrase) {
    const Diagnostic error = error_of(current);
    EXPECT_EQ(error.code, code) << current;
    EXPECT_NE((error.message + error.hint).find(phrase), std::string::npos) << error.message;
  };
  expect("<current speed=\"0.1\"/>", "MIS-CURRENT", "towards_deg");
  expect("<current towards_deg=\"90\"/>", "MIS-CURRENT", "speed");
  expect("<current table=\"tide.csv\"/>", "MIS-CURRENT", "start=\"HH:MM\"");
  expect("<current start=\"10:00\"/>", "MIS-CURRENT", "table");
  expect("<current start=\"10:00\" speed=\"0.1\" towards_deg=\"90\" table=\"tide.csv\"/>",
         "MIS-CURRENT", "either");
  expect("<current start=\"25:60\" table=\"tide.csv\"/>", "XSD-VALUE", "HH:MM");
  expect("<current speed=\"3.5\" towards_deg=\"90\"/>", "XSD-VALUE", "from 0 to 3");
  expect("<current table=\"tide.csv\" start=\"10:00\"> </current>", "MIS-CURRENT-TABLE", "content");
  expect(
      "<current start=\"10:00\"><sample time=\"11:00\" speed=\"0\" towards_deg=\"0\"/><sample "
      "time=\"10:30\" speed=\"0\" towards_deg=\"0\"/></current>",
      "MIS-CURRENT", "not later");
}

}  // namespace
}  // namespace dive::mission
