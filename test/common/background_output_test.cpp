#include "common/background_output.h"

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "test/common/allocations.h"

namespace dive {
namespace {

using std::chrono::milliseconds;

// A sink that can be stopped, as by a disk that does not answer.
struct Disk {
  std::atomic<bool> stalled = false;
  std::atomic<bool> was_called = false;
  std::vector<std::string> blocks;

  static BackgroundOutput::Sink sink(const std::shared_ptr<Disk>& disk) {
    return [disk](std::span<const std::uint8_t> block) {
      disk->was_called = true;
      disk->stalled.wait(true);
      disk->blocks.emplace_back(block.begin(), block.end());
    };
  }
  void go_on() {
    stalled = false;
    stalled.notify_all();
  }
  void wait_until_called() const {
    while (!was_called) std::this_thread::yield();
  }
};

std::string text(std::size_t number, std::size_t size) {
  std::string result = std::to_string(number) + ":";
  while (result.size() < size) result += static_cast<char>('a' + (number + result.size()) % 26);
  return result;
}

TEST(BackgroundOutput, PassesEveryBlockOnceAndInOrder) {
  const auto disk = std::make_shared<Disk>();
  std::vector<std::string> expected;
  Random random(3);
  {
    BackgroundOutput output(1000, WhenFull::kWait, Disk::sink(disk));
    for (std::size_t i = 0; i < 20'000; ++i) {
      // Some are larger than the queue.
      expected.push_back(text(i, random.bits() % (i % 100 == 0 ? 3000 : 300)));
      ASSERT_TRUE(output.push(expected.back()));
    }
    EXPECT_TRUE(output.close());
    EXPECT_EQ(output.done(), expected.size());
    EXPECT_FALSE(output.push(std::string_view("late")));
  }
  EXPECT_EQ(disk->blocks, expected);
}

TEST(BackgroundOutput, OfAStalledDiskItDropsWhatDoesNotFitAndAllocatesNothing) {
  const auto disk = std::make_shared<Disk>();
  disk->stalled = true;
  BackgroundOutput output(1000, WhenFull::kDrop, Disk::sink(disk));
  ASSERT_TRUE(output.push(text(0, 96)));
  disk->wait_until_called();
  const std::string block = text(1, 96);
  testing::reset_allocations();
  int queued = 1;
  while (output.push(block)) ++queued;
  EXPECT_EQ(testing::allocations().count, 0U);
  EXPECT_EQ(queued, 10) << "96 bytes and their length, in a queue of 1000";
  EXPECT_FALSE(output.push(text(2, 2000))) << "larger than the queue";
  EXPECT_EQ(output.done(), 0U);
  EXPECT_FALSE(output.drain(milliseconds(1)));
  disk->go_on();
  EXPECT_TRUE(output.drain(milliseconds(600'000)));
  EXPECT_EQ(output.done(), 10U);
  EXPECT_TRUE(output.push(block)) << "it has room again";
  EXPECT_TRUE(output.close());
  EXPECT_EQ(disk->blocks.size(), 11U);
}

TEST(BackgroundOutput, ADeadDiskDoesNotKeepItFromEnding) {
  const auto disk = std::make_shared<Disk>();
  disk->stalled = true;
  {
    BackgroundOutput output(1000, WhenFull::kDrop, Disk::sink(disk));
    ASSERT_TRUE(output.push(std::string_view("first")));
    ASSERT_TRUE(output.push(std::string_view("second")));
    disk->wait_until_called();
    EXPECT_FALSE(output.close(milliseconds(1)));
  }
  std::weak_ptr<Disk> thread = disk;
  disk->go_on();
  while (thread.use_count() > 1) std::this_thread::yield();
  EXPECT_EQ(disk->blocks.size(), 1U) << "the rest of the queue is dropped";
}

}  // namespace
}  // namespace dive
