// `dive check` on every malformed mission: exit status 2, and in its JSON the code and the line
// given in test/mission/malformed/expectations.txt.

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

const fs::path kFolder = fs::path(DIVE_SOURCE_DIR) / "test/mission/malformed";

using CodeAndLine = std::pair<std::string, int>;

std::map<std::string, std::vector<CodeAndLine>> expectations() {
  std::map<std::string, std::vector<CodeAndLine>> result;
  std::ifstream stream(kFolder / "expectations.txt");
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    std::string file;
    CodeAndLine expected;
    if (words >> file >> expected.first >> expected.second) result[file].push_back(expected);
  }
  return result;
}

std::vector<CodeAndLine> errors_in(const nlohmann::json& report) {
  std::vector<CodeAndLine> errors;
  for (const auto& diagnostic : report.at("diagnostics")) {
    if (diagnostic.at("severity") != "error") continue;
    errors.emplace_back(diagnostic.at("code"), diagnostic.at("line"));
    EXPECT_FALSE(diagnostic.at("message").get<std::string>().empty());
  }
  return errors;
}

TEST(CheckCommand, RefusesEveryMalformedMissionWithItsCodeAndLine) {
  const auto expected = expectations();
  ASSERT_GE(expected.size(), 40U);
  for (const auto& [file, errors] : expected) {
    const testing::Ran ran =
        testing::run_dive("check --json '" + (kFolder / file).string() + "'", "malformed");
    EXPECT_EQ(ran.status, 2) << file;
    const auto report = nlohmann::json::parse(ran.out, nullptr, false);
    ASSERT_FALSE(report.is_discarded()) << file << ": " << ran.out.substr(0, 200);
    EXPECT_FALSE(report.at("ok").get<bool>()) << file;
    EXPECT_EQ(errors_in(report), errors) << file;
  }
}

TEST(CheckCommand, IsNotDrownedByAHugeFile) {
  const fs::path folder = fs::path(::testing::TempDir()) / "dive-huge";
  fs::create_directories(folder);
  {
    std::ofstream stream(folder / "nesting.xml");
    for (int i = 0; i < 3'500'000; ++i) stream << "<a>";
  }
  const testing::Ran ran =
      testing::run_dive("check '" + (folder / "nesting.xml").string() + "'", "huge");
  EXPECT_EQ(ran.status, 2);
  EXPECT_NE(ran.err.find("larger than"), std::string::npos) << ran.err;
  fs::remove_all(folder);
}

}  // namespace
}  // namespace dive::mission
