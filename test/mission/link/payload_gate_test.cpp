#include "mission/link/payload_gate.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

const std::vector<ActionRecord> kCommands = {{ActionRecord::Kind::kPayload, "marker", true},
                                             {ActionRecord::Kind::kNote, "not a command"},
                                             {ActionRecord::Kind::kPayload, "photo", false}};

class PayloadGateTest : public ::testing::Test {
 protected:
  void pass(std::span<const ActionRecord> actions, bool is_on_disk, Utime after = 20'000) {
    now_ += after;
    gate_.pass(now_, actions, is_on_disk,
               [this](const ActionRecord& command) { sent_.push_back(command.text); });
  }

  PayloadGate gate_;
  Utime now_ = 0;
  std::vector<std::string> sent_;
};

TEST_F(PayloadGateTest, SendsAtOnceWhatIsOnTheDisk) {
  pass(kCommands, true);
  EXPECT_EQ(sent_, (std::vector<std::string>{"marker", "photo"}));
}

TEST_F(PayloadGateTest, HoldsBackUntilTheDiskHasThem) {
  pass(kCommands, false);
  pass({}, false, PayloadGate::kLimit - 1);
  EXPECT_TRUE(sent_.empty());
  pass({}, true, 0);
  EXPECT_EQ(sent_, (std::vector<std::string>{"marker", "photo"}));
  pass({}, true);
  EXPECT_EQ(sent_.size(), 2U) << "once";
  EXPECT_EQ(gate_.withheld(), 0);
}

TEST_F(PayloadGateTest, OfADeadDiskSendsOnlyWhatMayBeRepeated) {
  pass(kCommands, false);
  pass({}, false, PayloadGate::kLimit);
  EXPECT_EQ(sent_, std::vector<std::string>{"photo"});
  EXPECT_EQ(gate_.withheld(), 1);
  pass({}, true);
  EXPECT_EQ(sent_.size(), 1U) << "too late is never";
}

}  // namespace
}  // namespace dive::mission
