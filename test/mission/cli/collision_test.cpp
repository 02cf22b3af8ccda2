// Collisions of a simulated vehicle: the reports of check, run and explain, and that the commands
// in their hints reproduce the same collision. The mission is written for these tests; only an
// undeclared current makes it collide.

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::own_folder;
using testing::Ran;
using testing::run_here;

const std::string kQuay = "'" DIVE_SOURCE_DIR "/test/mission/collision/quay.xml'";

Json object_of(const Ran& ran) { return Json::parse(ran.out); }

std::vector<Json> diagnostics_of(const Json& check, const std::string& code) {
  std::vector<Json> found;
  for (const Json& diagnostic : check.at("diagnostics")) {
    if (diagnostic.at("code") == code) found.push_back(diagnostic);
  }
  return found;
}

// The report of the command in a hint, run as written.
Json hinted_run(const Json& diagnostic) {
  const std::string hint = diagnostic.at("hint");
  const std::string before = "reproduce it with: dive ";
  EXPECT_THAT(hint, ::testing::StartsWith(before));
  return object_of(run_here(hint.substr(before.size()) + " --json --force --log again.lcmlog"));
}

TEST(Collision, IsLocatedByRunAndByItsLog) {
  const Ran ran = run_here("run " + kQuay + " --seed 2 --set current_y=0.15 --log a.lcmlog --json");
  EXPECT_EQ(ran.status, 1) << ran.err;
  const Json result = object_of(ran);
  EXPECT_EQ(result.at("outcome"), "failure");
  const Json list = result.at("collision_list");
  ASSERT_EQ(list.size(), result.at("collisions"));
  ASSERT_FALSE(list.empty());
  const Json& first = list.at(0);
  EXPECT_EQ(first.at("obstacle"), "harbour/ground/quay");
  // The quay is at y = 1.4; no part of the hull is more than 0.45 m from the vehicle's origin.
  EXPECT_GT(first.at("y").get<double>(), 1.4 - 0.45);
  EXPECT_LT(first.at("y").get<double>(), 1.4);
  EXPECT_GT(first.at("t").get<double>(), 3.0);
  EXPECT_LT(first.at("t").get<double>(), result.at("duration_s").get<double>());
  const Json& estimated = first.at("estimated");
  const double error = std::hypot(first.at("x").get<double>() - estimated.at("x").get<double>(),
                                  first.at("y").get<double>() - estimated.at("y").get<double>());
  EXPECT_NEAR(first.at("error_m").get<double>(), error, 1e-12);
  EXPECT_GT(error, 0.5) << "the estimate does not know of the current";
  EXPECT_GT(first.at("sigma_m").get<double>(), 0.0);
  EXPECT_EQ(result.at("min_clearance_m"), 0.0);
  EXPECT_EQ(result.at("nearest").at("t"), first.at("t"));
  EXPECT_THAT(result.at("cause").get<std::string>(), HasSubstr("with 'harbour/ground/quay' at "));

  const Json explained = object_of(run_here("explain a.lcmlog --json"));
  EXPECT_EQ(explained.at("collision_list"), list);
  EXPECT_THAT(run_here("explain a.lcmlog").out,
              HasSubstr("collision with 'harbour/ground/quay' at "));
  EXPECT_EQ(run_here("replay a.lcmlog").status, 0);
}

TEST(Collision, IsMarkedInTheDrawingAndNamedInTheText) {
  const Ran ran = run_here("run " + kQuay + " --seed 2 --set current_y=0.15 --svg a.svg");
  EXPECT_EQ(ran.status, 1) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("  collision with 'harbour/ground/quay' at "));
  EXPECT_THAT(ran.out, HasSubstr("nearest approach: 0.00 m from 'harbour/ground/quay'"));
  const std::string svg = testing::content_of(own_folder() / "a.svg");
  EXPECT_THAT(svg, HasSubstr(">harbour/ground/quay, "));
}

// In a folder whose name needs quoting in a shell.
TEST(Collision, IsReproducedByTheHintOfCheck) {
  const fs::path folder = fs::path(::testing::TempDir()) / "dive's own (copy)";
  fs::create_directories(folder);
  fs::copy(fs::path(DIVE_SOURCE_DIR) / "test/mission/collision", folder,
           fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  const Ran ran = run_here("check --dives 1 \"" + (folder / "quay.xml").string() +
                           "\" --json --seed 5 --set current_y=0.15 --set depth_noise_m=0.013");
  EXPECT_EQ(ran.status, 1) << ran.err;
  const Json check = object_of(ran);
  const std::vector<Json> found = diagnostics_of(check, "CHK-DIVE");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].at("message").get<std::string>(), HasSubstr("'harbour/ground/quay' at "));
  EXPECT_TRUE(diagnostics_of(check, "CHK-DIVE-CLEARANCE").empty()) << "the error says it";
  const Json again = hinted_run(found[0]);
  ASSERT_FALSE(check.at("dive").at("collision_list").empty());
  EXPECT_EQ(again.at("collision_list"), check.at("dive").at("collision_list"));
  EXPECT_EQ(again.at("transitions"), check.at("dive").at("transitions"));
  fs::remove_all(folder);
}

TEST(Collision, ThatWasNearIsAWarningWithItsPlace) {
  const Ran ran = run_here("check --dives 1 " + kQuay + " --json --set current_y=0.045");
  EXPECT_EQ(ran.status, 0) << ran.err;
  const Json check = object_of(ran);
  const std::vector<Json> found = diagnostics_of(check, "CHK-DIVE-CLEARANCE");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].at("severity"), "warning");
  const Json& nearest = check.at("dive").at("nearest");
  EXPECT_EQ(nearest.at("obstacle"), "harbour/ground/quay");
  EXPECT_LT(check.at("dive").at("min_clearance_m").get<double>(), 0.4);
  EXPECT_THAT(found[0].at("message").get<std::string>(),
              ::testing::AllOf(HasSubstr("'harbour/ground/quay' at "), HasSubstr("(0.8 m)")));
  EXPECT_EQ(hinted_run(found[0]).at("nearest"), nearest);

  const Ran calm = run_here("check --dives 1 " + kQuay);
  EXPECT_EQ(calm.status, 0) << calm.err;
  EXPECT_THAT(calm.err, Not(HasSubstr("CHK-DIVE-CLEARANCE")));
  EXPECT_THAT(calm.out, HasSubstr("nearest approach: "));
}

// A fault that keeps the vehicle in the current for longer than in the nominal dive.
TEST(Collision, AfterAFaultIsReproducedByTheHintOfCheck) {
  const Ran ran =
      run_here("check --dives 1 " + kQuay + " --faults --json --seed 3 --set current_y=0.03");
  EXPECT_EQ(ran.status, 1) << ran.err;
  const Json check = object_of(ran);
  std::map<std::string, Json> lists;  // indexed by NAME@SECONDS
  for (const Json& fault : check.at("faults")) {
    const Json& injected = fault.at("injected").at(0);
    const std::string name =
        injected.at("fault").get<std::string>() + "@" + injected.at("t").dump();
    if (!fault.at("safe")) lists[name] = fault.at("collision_list");
  }
  const std::vector<Json> found = diagnostics_of(check, "CHK-FAULT");
  ASSERT_FALSE(found.empty());
  ASSERT_EQ(found.size(), lists.size());
  for (std::size_t i = 0; i < std::min<std::size_t>(found.size(), 2); ++i) {
    const std::string hint = found[i].at("hint");
    const Json& list = lists[hint.substr(hint.rfind(' ') + 1)];
    ASSERT_FALSE(list.empty()) << hint;
    EXPECT_THAT(found[i].at("message").get<std::string>(), HasSubstr("'harbour/ground/quay' at "));
    EXPECT_EQ(hinted_run(found[i]).at("collision_list"), list) << found[i];
  }
}

}  // namespace
}  // namespace dive::mission
