// The progress of `dive check` if stderr is not a terminal.

#include "mission/cli/check_progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/cli/work_progress.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

class SetClock final : public Clock {
 public:
  [[nodiscard]] Utime now() override { return from_seconds(now_s); }
  double now_s = 0.0;
};

TEST(ProgressBar, FillsUp) {
  EXPECT_EQ(progress_bar(0.0, 6), "[      ]");
  EXPECT_EQ(progress_bar(0.5, 6), "[==>   ]");
  EXPECT_EQ(progress_bar(1.7, 6), "[=====>]");
}

TEST(RoundedDuration, HasTheUnitThatFits) {
  EXPECT_EQ(rounded_duration(8.6), "9 s");
  EXPECT_EQ(rounded_duration(200.0), "3 min 20 s");
  EXPECT_EQ(rounded_duration(7500.0), "2 h 5 min");
  EXPECT_EQ(rounded_size(1), "1 kB");
  EXPECT_EQ(rounded_size(23'400), "24 kB");
  EXPECT_EQ(rounded_size(1'530'000), "1.5 MB");
}

TEST(CheckProgress, HasALineEveryTenSecondsWithTheTimeThatRemains) {
  SetClock clock;
  ::testing::internal::CaptureStderr();
  {
    CheckProgress progress(clock, false);
    clock.now_s = 100.0;
    progress.on_step("fault dives");
    for (int i = 1; i <= 25; ++i) {
      clock.now_s += 1.0;
      progress.on_progress(i, 100.0, "dives", 0.01 * i);
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "check: fault dives\n"
            "check: 10 of 100 dives, 1 min 30 s left\n"
            "check: 20 of 100 dives, 1 min 20 s left\n");
}

TEST(CheckProgress, NamesBothTimesOfADiveThatTakesLongerThanExpected) {
  SetClock clock;
  ::testing::internal::CaptureStderr();
  {
    CheckProgress progress(clock, false);
    progress.on_step("simulated dive");
    clock.now_s = 10.0;
    progress.on_progress(295.0, 223.0, "s of the dive", 295.0 / 223.0);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "check: simulated dive\n"
            "check: 295 s of the dive, expected 223\n");
}

TEST(CheckProgress, ShowsAFindingAtOnceAndIsSilentWhenQuiet) {
  SetClock clock;
  FaultResult result;
  result.fault = {"in", {{FaultKind::kLeak, 12.34}}};
  const auto written = [&](bool is_quiet) {
    ::testing::internal::CaptureStderr();
    {
      CheckProgress progress(clock, is_quiet);
      progress.on_step("fault dives");
      progress.on_finding(result, "dive run m.xml --fault leak@12.34");
      clock.now_s += 20.0;
      progress.on_progress(1.0, 2.0, "dives", 0.5);
    }
    return ::testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(written(true), "");
  const std::string lines = written(false);
  EXPECT_THAT(lines, HasSubstr("leak at 12.34 s in 'in'"));
  EXPECT_THAT(lines, HasSubstr(": dive run m.xml --fault leak@12.34\n"));
  EXPECT_THAT(lines, HasSubstr("1 of 2 dives, 1 finding(s), 20 s left\n"));
}

TEST(WorkProgress, SaysWhatRemainsEveryTenSeconds) {
  SetClock clock;
  ::testing::internal::CaptureStderr();
  {
    WorkProgress progress(clock, "replaying");
    for (int i = 1; i <= 25; ++i) {
      clock.now_s += 1.0;
      progress.show(0.01 * i);
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "replaying: 10 %, 1 min 30 s left\n"
            "replaying: 20 %, 1 min 20 s left\n");
}

TEST(WorkProgress, IsSilentWhereItIsToBe) {
  SetClock clock;
  ::testing::internal::CaptureStderr();
  {
    WorkProgress progress(clock, "replaying", true);
    clock.now_s = 100.0;
    progress.show(0.5);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace dive::mission
