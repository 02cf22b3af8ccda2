// Reports in a headless Chromium without a network: the page tests itself (mission/report/page/
// self_test.js) and these tests read its result. Skipped, with a message, without Chromium.

#include <array>
#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/mission/cli/run_command.h"
#include "test/mission/report/report_dive.h"

namespace dive::mission {
namespace {

using nlohmann::json;
using ::testing::Contains;
using testing::content_of;
using testing::dive_and_report;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using testing::ReportedDive;

const std::string kWindow = "'" DIVE_SOURCE_DIR "/missions/window.xml'";

/// The page after its self-test, as HTML.
std::string rendered(const std::string& page, const std::string& folder,
                     const std::string& options = {}) {
  const std::string command =
      "cd '" + folder + "' && HOME='" + folder +
      "' timeout 120 chromium --headless=new --no-sandbox --user-data-dir=profile "
      "--disable-dev-shm-usage --proxy-server=127.0.0.1:1 --host-resolver-rules='MAP * ~NOTFOUND' "
      "--virtual-time-budget=5000 " +
      options + " --dump-dom 'file://" + page + "#selftest' >dom.html 2>chromium.txt </dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0) << content_of(folder + "/chromium.txt");
  return content_of(folder + "/dom.html");
}

json self_test_of(const std::string& dom) {
  const std::string begin = "<pre id=\"self-test\">";
  const std::size_t at = dom.find(begin);
  if (at == std::string::npos) return json::object();
  return json::parse(dom.substr(at + begin.size(), dom.find("</pre>", at) - at - begin.size()));
}

constexpr const char* kSoftwareGl = "--use-angle=swiftshader --enable-unsafe-swiftshader";

class ReportPage : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v chromium >/dev/null 2>&1") != 0) {
      GTEST_SKIP() << "chromium is not installed";
    }
  }
};

void expect_working(const json& result) {
  ASSERT_TRUE(result.contains("views")) << "the page did not run to its end";
  EXPECT_TRUE(result.at("errors").empty()) << result.at("errors");
  EXPECT_TRUE(result.at("requests").empty()) << result.at("requests");
  EXPECT_EQ(result.at("moved"), result.at("views"));
  EXPECT_EQ(result.at("restored"), result.at("views"));
  EXPECT_TRUE(result.at("key_moves"));
}

TEST_F(ReportPage, OneCursorMovesAllViews) {
  const ReportedDive dived = dive_and_report(kWindow);
  const json result = self_test_of(rendered(dived.page_path, dived.folder, kSoftwareGl));
  expect_working(result);
  EXPECT_THAT(result.at("views").get<std::vector<std::string>>(),
              IsSupersetOf({"time_bar", "chart_0", "chart_6", "events", "paths", "scene"}));
  EXPECT_TRUE(result.at("webgl"));
  EXPECT_TRUE(result.at("drawn")) << "the scene is empty";
}

TEST_F(ReportPage, WithoutWebGlOnlyTheSceneIsMissing) {
  const ReportedDive dived = dive_and_report(kWindow);
  const std::string dom = rendered(dived.page_path, dived.folder, "--disable-3d-apis");
  const json result = self_test_of(dom);
  expect_working(result);
  EXPECT_FALSE(result.at("webgl"));
  EXPECT_THAT(result.at("views").get<std::vector<std::string>>(), Contains("chart_0"));
  EXPECT_THAT(dom, HasSubstr("This browser has no WebGL"));
}

TEST_F(ReportPage, TellsWhatIsNotKnownWithoutGroundTruth) {
  const ReportedDive dived = dive_and_report(kWindow);
  const std::string log = dived.folder + "/vehicle.lcmlog";
  testing::rewrite_log(
      dived.log, log, [](LogHeader&) {}, [](LoggedTick& tick) { tick.truth.reset(); });
  const std::string page = dived.folder + "/vehicle.html";
  ASSERT_EQ(
      testing::run_dive("report '" + log + "' --output '" + page + "' --force", "vehicle").status,
      0);
  const std::string dom = rendered(page, dived.folder, kSoftwareGl);
  expect_working(self_test_of(dom));
  EXPECT_THAT(dom, HasSubstr("<dt>Collisions</dt><dd>not known"));
  EXPECT_THAT(dom, HasSubstr("<dt>Least clearance</dt><dd>not known"));
  EXPECT_THAT(dom, HasSubstr("<dt>Final position error</dt><dd>not known"));
}

TEST_F(ReportPage, SaysAtTheTopHowTheMissionWasChecked) {
  const ReportedDive dived = dive_and_report(kWindow);
  const std::string hash = "0123456789ab" + std::string(52, 'c');
  const std::pair<std::string, const char*> checks[] = {
      {"", "<span>mission file, not a verified bundle</span>"},
      {"unchecked", "<span>unchecked: dived with --unchecked</span>"},
      {"bundle " + hash, ">verified bundle <code>0123456789ab</code></span>"},
      {"bundle " + hash + ", unchecked",
       ">bundle, dived with --unchecked <code>0123456789ab</code></span>"},
      {"<b>by hand</b>", "<span>check: &lt;b&gt;by hand&lt;/b&gt;</span>"}};
  for (const auto& [check, shown] : checks) {
    const std::string log = dived.folder + "/checked.lcmlog";
    testing::rewrite_log(
        dived.log, log, [&](LogHeader& header) { header.check = check; }, [](LoggedTick&) {});
    const std::string page = dived.folder + "/checked.html";
    ASSERT_EQ(
        testing::run_dive("report '" + log + "' --output '" + page + "' --force", "checked").status,
        0);
    const std::string dom = rendered(page, dived.folder, "--disable-3d-apis");
    const std::size_t top = dom.find("title=\"SHA-256 ");  // beside the hashes
    ASSERT_NE(top, std::string::npos);
    EXPECT_THAT(dom.substr(top, dom.find("</p>", top) - top), HasSubstr(shown)) << check;
  }
}

TEST_F(ReportPage, ShowsAPlanWithoutATimeAxis) {
  const std::string folder = testing::folder_of_test();
  const std::string page = folder + "/plan.html";
  const testing::Ran ran =
      testing::run_dive("report " + kWindow + " --output '" + page + "' --force", "plan");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const std::string dom = rendered(page, folder, kSoftwareGl);
  const json result = self_test_of(dom);
  ASSERT_TRUE(result.contains("errors"));
  EXPECT_TRUE(result.at("errors").empty()) << result.at("errors");
  EXPECT_TRUE(result.at("drawn"));
  EXPECT_THAT(dom, HasSubstr("window: 3 legs planned"));
}

TEST_F(ReportPage, ShowsTextsWithMarkupAsTheyAre) {
  const ReportedDive dived = dive_and_report(kWindow);
  const std::string log = dived.folder + "/strange.lcmlog";
  testing::rewrite_log(
      dived.log, log,
      [](LogHeader& header) { header.mission_name = "</script><b>bold</b>\"'.xml"; },
      [](LoggedTick& tick) {
        for (TransitionRecord& transition : tick.outputs.transitions) {
          transition.cause += "</script><img src=x onerror=\"document.title='run'\">";
        }
      });
  const std::string page = dived.folder + "/strange.html";
  ASSERT_EQ(
      testing::run_dive("report '" + log + "' --output '" + page + "' --force", "strange").status,
      0);
  const std::string dom = rendered(page, dived.folder, kSoftwareGl);
  expect_working(self_test_of(dom));
  EXPECT_THAT(dom, HasSubstr("mission &lt;/script&gt;&lt;b&gt;bold&lt;/b&gt;\"'.xml"));
  EXPECT_THAT(dom, HasSubstr("<title>window: dive</title>"));
}

}  // namespace
}  // namespace dive::mission
