#include "mission/language_server/background_check.h"

#include <functional>
#include <future>
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

}  // namespace
}  // namespace dive::mission
