#include "mission/onboard/delayed_worker.h"

#include <atomic>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

/// A task that gives its number once it is let go.
class Gate {
 public:
  auto task(int number) {
    return [future = released_, number] {
      future.wait();
      return number;
    };
  }
  void release() { promise_.set_value(); }

 private:
  std::promise<void> promise_;
  std::shared_future<void> released_ = promise_.get_future().share();
};

void wait_until_finished(const DelayedWorker<int>& worker) {
  while (!worker.has_finished()) std::this_thread::yield();
}

TEST(DelayedWorker, GivesAResultWhenItIsDueAndOnce) {
  for (const OnLate late : {OnLate::kBlock, OnLate::kPoll}) {
    DelayedWorker<int> worker(late);
    EXPECT_TRUE(worker.is_idle());
    worker.start(100, [] { return 7; });
    wait_until_finished(worker);
    EXPECT_EQ(worker.poll(99), std::nullopt) << "it must not depend on the machine";
    EXPECT_FALSE(worker.is_idle());
    EXPECT_EQ(worker.poll(100), 7);
    EXPECT_EQ(worker.poll(101), std::nullopt);
    EXPECT_TRUE(worker.is_idle());
  }
}

TEST(DelayedWorker, OnAVehicleNothingWaitsForIt) {
  Gate gate;
  DelayedWorker<int> worker(OnLate::kPoll);
  EXPECT_TRUE(worker.may_start());
  worker.start(100, gate.task(7));
  EXPECT_FALSE(worker.may_start());
  EXPECT_EQ(worker.poll(200), std::nullopt);
  gate.release();
  wait_until_finished(worker);
  EXPECT_TRUE(worker.may_start());
  EXPECT_EQ(worker.poll(300), 7);
}

TEST(DelayedWorker, InSimulationADueResultIsWaitedFor) {
  Gate gate;
  DelayedWorker<int> worker(OnLate::kBlock);
  worker.start(100, gate.task(7));
  EXPECT_TRUE(worker.may_start());
  EXPECT_EQ(worker.poll(99), std::nullopt) << "nor is it waited for before";
  std::thread later([&] { gate.release(); });
  EXPECT_EQ(worker.poll(100), 7);
  later.join();
}

TEST(DelayedWorker, KeepsResultsInTheOrderInWhichTheyWereAskedFor) {
  DelayedWorker<int> worker(OnLate::kBlock);
  worker.start(100, [] { return 1; });
  worker.start(150, [] { return 2; });
  worker.collect();
  ASSERT_EQ(worker.waiting().size(), 2U);
  EXPECT_EQ(worker.waiting().back().result, 2);
  EXPECT_EQ(worker.poll(149), 1);
  EXPECT_EQ(worker.poll(149), std::nullopt);
  EXPECT_EQ(worker.poll(150), 2);
  worker.start(200, [] { return 3; });
  worker.collect();
  worker.drop_waiting();
  EXPECT_EQ(worker.poll(300), std::nullopt);
}

TEST(DelayedWorker, InSimulationItThrowsWhatTheTaskThrew) {
  DelayedWorker<int> worker(OnLate::kBlock);
  worker.start(0, []() -> int { throw std::runtime_error("no"); });
  EXPECT_THROW(static_cast<void>(worker.poll(0)), std::runtime_error);
}

TEST(DelayedWorker, OnAVehicleATaskThatThrowsGivesNothingButItsMessage) {
  DelayedWorker<int> worker(OnLate::kPoll);
  worker.start(0, []() -> int { throw std::runtime_error("no"); });
  wait_until_finished(worker);
  EXPECT_EQ(worker.poll(0), std::nullopt);
  EXPECT_EQ(worker.take_failure(), "no");
  EXPECT_EQ(worker.take_failure(), std::nullopt);
  worker.start(100, [] { return 7; });
  wait_until_finished(worker);
  EXPECT_EQ(worker.poll(100), 7) << "it goes on";
}

TEST(DelayedWorker, EndsAfterItsTask) {
  std::atomic<bool> is_done = false;
  {
    DelayedWorker<int> worker(OnLate::kPoll);
    worker.start(0, [&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      is_done = true;
      return 0;
    });
  }
  EXPECT_TRUE(is_done);
}

}  // namespace
}  // namespace dive::mission
