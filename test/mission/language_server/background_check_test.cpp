#include "mission/language_server/background_check.h"

#include <functional>
#include <future>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

// The first check runs until its text has changed; typing goes on meanwhile.
TEST(BackgroundCheckTest, DropsWhatIsOutdatedAndSkipsWhatWasNeverNewest) {
  std::promise<void> running;
  std::promise<int> result;
  std::vector<std::string> checked;
  std::vector<int> done;
  BackgroundCheck check(
      [&](const SourceText& text, const std::function<bool()>& is_outdated) {
        checked.push_back(text.content());
        if (checked.size() == 1) {
          running.set_value();
          while (!is_outdated()) std::this_thread::yield();
        }
        return CheckedText{};
      },
      [&](const BackgroundCheck::Request& request, const CheckedText&) {
        done.push_back(request.version);
        result.set_value(request.version);
      });
  check.check({"file:///m.xml", 1, "one"});
  running.get_future().wait();
  check.check({"file:///closed.xml", 1, "closed"});
  check.forget("file:///closed.xml");
  check.check({"file:///m.xml", 2, "two"});
  EXPECT_EQ(result.get_future().get(), 2);
  EXPECT_EQ(checked, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(done, std::vector<int>{2});
}

TEST(BackgroundCheckTest, AnErrorOfTheCheckIsAFindingAndTheNextTextIsChecked) {
  std::promise<CheckedText> first;
  std::promise<CheckedText> second;
  BackgroundCheck check(
      [&](const SourceText& text, const std::function<bool()>&) -> std::optional<CheckedText> {
        if (text.content() == "bad") throw std::runtime_error("a mistake");
        return CheckedText{};
      },
      [&](const BackgroundCheck::Request& request, const CheckedText& result) {
        (request.version == 1 ? first : second).set_value(result);
      });
  check.check({"untitled:Untitled-1", 1, "bad"});
  const CheckedText result = first.get_future().get();
  ASSERT_EQ(result.findings.size(), 1U);
  EXPECT_NE(result.findings[0].message.find("a mistake"), std::string::npos);
  check.check({"untitled:Untitled-1", 2, "good"});
  EXPECT_TRUE(second.get_future().get().findings.empty());
}

}  // namespace
}  // namespace dive::mission
