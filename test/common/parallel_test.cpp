#include "common/parallel.h"

#include <atomic>
#include <mutex>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace dive {
namespace {

TEST(RunInParallel, CallsEachOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 7, 40}) {
    std::vector<std::atomic<int>> calls(23);
    run_in_parallel(calls.size(), threads, [&](std::size_t i) { ++calls[i]; });
    for (const std::atomic<int>& count : calls) EXPECT_EQ(count, 1) << threads << " threads";
  }
  run_in_parallel(0, 2, [](std::size_t) { FAIL(); });
}

TEST(RunInParallel, BeginsInOrder) {
  std::vector<std::size_t> begun;
  run_in_parallel(9, 1, [&](std::size_t i) { begun.push_back(i); });
  EXPECT_EQ(begun, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST(RunInParallel, RethrowsAndBeginsNothingMore) {
  std::atomic<int> calls = 0;
  const auto work = [&](std::size_t) {
    ++calls;
    throw std::runtime_error("no");
  };
  EXPECT_THROW(run_in_parallel(1000, 1, work), std::runtime_error);
  EXPECT_EQ(calls, 1);
  calls = 0;
  EXPECT_THROW(run_in_parallel(1000, 4, work), std::runtime_error);
  EXPECT_LE(calls, 4);
}

TEST(RunInParallelWhile, CallsEachOnceUntilItIsToldToStop) {
  for (const int threads : {1, 2, 7}) {
    std::vector<std::atomic<int>> calls(23);
    const std::size_t count = run_in_parallel_while([](std::size_t i) { return i != 11; }, threads,
                                                    [&](std::size_t i) { ++calls[i]; });
    EXPECT_EQ(count, 11U);
    for (std::size_t i = 0; i < calls.size(); ++i) EXPECT_EQ(calls[i], i < 11 ? 1 : 0) << i;
  }
}

TEST(ThreadCount, IsAsAskedOrOnePerCore) {
  EXPECT_EQ(thread_count(3), 3);
  EXPECT_GE(thread_count(0), 1);
}

}  // namespace
}  // namespace dive
