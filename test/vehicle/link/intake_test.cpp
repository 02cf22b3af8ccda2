// What arrives from a network, without a network: datagrams, fragments, authentication, freshness,
// allowances.

#include "vehicle/link/intake.h"

#include <algorithm>
#include <random>
#include <utility>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "test/vehicle/link/datagrams.h"
#include "vehicle/link/channels.h"

namespace dive::link {
namespace {

using testing::Bytes;
using testing::fragment_datagram;
using testing::FragmentHeader;
using testing::fragments;
using testing::short_datagram;

constexpr std::uint64_t kAddress = 1;
constexpr Utime kSecond = kMicrosecondsPerSecond;

std::vector<Arrival> arrivals(Intake& intake) {
  std::vector<Arrival> all;
  while (std::optional<Arrival> arrival = intake.queue().pop()) all.push_back(std::move(*arrival));
  return all;
}

Packet counted(std::size_t size) {
  Packet packet(size);
  for (std::size_t i = 0; i < size; ++i) packet[i] = static_cast<std::uint8_t>(i * 7 + i / 256);
  return packet;
}

// --- datagrams and fragments ---

TEST(Datagram, IsRefusedUnlessItIsConsistent) {
  const Packet data(100);
  EXPECT_TRUE(parse_datagram(short_datagram("A", data)));
  EXPECT_FALSE(parse_datagram(short_datagram("", data)));
  EXPECT_TRUE(parse_datagram(short_datagram(std::string(63, 'a'), data)));
  EXPECT_FALSE(parse_datagram(short_datagram(std::string(64, 'a'), data)));
  EXPECT_FALSE(parse_datagram(testing::overflowing_datagram("DIVE_IMU")));
  const auto accepts = [&](FragmentHeader header, std::string_view channel) {
    return parse_datagram(fragment_datagram(header, channel, data)).has_value();
  };
  EXPECT_TRUE(accepts({.packet_size = 300, .fragments = 3}, "A"));
  EXPECT_FALSE(accepts({.packet_size = 300, .fragments = 3}, "")) << "no channel";
  EXPECT_FALSE(accepts({.packet_size = 300, .offset = 1, .fragments = 3}, "A"));
  EXPECT_FALSE(accepts({.packet_size = 99, .fragments = 3}, "A"));
  EXPECT_FALSE(accepts({.packet_size = 300, .fragments = 0}, "A"));
  EXPECT_TRUE(accepts({.packet_size = 300, .offset = 200, .fragment = 2, .fragments = 3}, ""));
  EXPECT_FALSE(accepts({.packet_size = 300, .offset = 201, .fragment = 2, .fragments = 3}, ""));
  EXPECT_FALSE(accepts({.packet_size = 300, .offset = 100, .fragment = 3, .fragments = 3}, ""));
  EXPECT_FALSE(accepts({.magic = 0x4c433034, .packet_size = 300, .fragments = 3}, "A"));
  const Bytes whole = fragment_datagram({.packet_size = 300, .fragments = 3}, "A", data);
  for (std::size_t cut = 0; cut < 22; ++cut) {
    EXPECT_FALSE(parse_datagram(std::span(whole).first(cut))) << cut;
  }
}

class Receiving : public ::testing::Test {
 protected:
  static constexpr std::size_t kMax = 300'000;

  Receiving() {
    intake_.subscribe("BIG", kMax, Access::kAuthentic);
    intake_.subscribe("SMALL", 100, Access::kAuthentic);
  }
  void take(const std::vector<Bytes>& datagrams, std::uint64_t address = kAddress) {
    for (const Bytes& datagram : datagrams) intake_.take(datagram, address, 0);
  }

  Intake intake_{std::nullopt, 0};
};

TEST_F(Receiving, FragmentsBecomeThePacketAgain) {
  for (const std::size_t size : {0U, 1U, 99U, 100U, 101U, 65'000U, 300'000U}) {
    const Packet packet = counted(size);
    take(fragments("BIG", packet, 100 + size / 5));
    if (size == 0) take({short_datagram("BIG", packet)});
    const std::vector<Arrival> received = arrivals(intake_);
    ASSERT_EQ(received.size(), 1U) << size;
    EXPECT_EQ(received[0].packet, packet);
    EXPECT_EQ(received[0].subscription, 0U);
  }
}

TEST_F(Receiving, APacketWithALostARepeatedOrAnOvertakenFragmentIsLostAndNoOther) {
  const Packet packet = counted(1000);
  const std::vector<Bytes> whole = fragments("BIG", packet, 300, 5);
  auto lost = whole;
  lost.erase(lost.begin() + 1);
  auto repeated = whole;
  repeated.insert(repeated.begin() + 1, whole[1]);
  auto overtaken = whole;
  std::swap(overtaken[1], overtaken[2]);
  auto mixed = whole;
  mixed[2] = fragments("BIG", packet, 300, 6)[2];
  for (const auto& broken : {lost, repeated, overtaken, mixed}) {
    take(broken);
    EXPECT_TRUE(arrivals(intake_).empty());
    take(fragments("BIG", packet, 300, 7));
    EXPECT_EQ(arrivals(intake_).size(), 1U);
  }
}

TEST_F(Receiving, SendersDoNotDisturbEachOther) {
  const std::vector<Bytes> a = fragments("BIG", counted(1000), 300, 5);
  const std::vector<Bytes> b = fragments("BIG", counted(900), 300, 5);
  for (std::size_t i = 0; i < a.size(); ++i) {
    intake_.take(a[i], 1, 0);
    if (i < b.size()) intake_.take(b[i], 2, 0);
  }
  EXPECT_EQ(arrivals(intake_).size(), 2U);
}

TEST_F(Receiving, WhatIsTooLargeForItsChannelIsCountedAndNotStored) {
  take({short_datagram("SMALL", Packet(100))});
  EXPECT_EQ(arrivals(intake_).size(), 1U);
  take({short_datagram("SMALL", Packet(101))});
  take({short_datagram("SMALL", Packet(60'000))});
  take(fragments("BIG", Packet(kMax + kTrailerSize + 1), 60'000));
  EXPECT_TRUE(arrivals(intake_).empty());
  EXPECT_EQ(intake_.rejections().malformed, 3);
  take({short_datagram("OTHER", Packet(101))});
  EXPECT_EQ(intake_.rejections().malformed, 3) << "not subscribed";
}

TEST_F(Receiving, MemoryOfPacketsInProgressIsBounded) {
  PacketAssembly assembly;
  const Packet packet(1'000'000);
  const std::vector<Bytes> parts = fragments("BIG", packet, 60'000);
  for (std::uint64_t address = 0; address < 1000; ++address) {
    for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
      static_cast<void>(
          assembly.add(address, false, *parse_datagram(parts[i]), i == 0 ? packet.size() : 0));
      ASSERT_LE(assembly.bytes(), PacketAssembly::kMaxBytes);
    }
  }
  // A sender that has authenticated packets is not shut out by all of these.
  std::optional<PacketAssembly::Complete> complete;
  for (const Bytes& part : parts) {
    complete = assembly.add(5000, true, *parse_datagram(part), packet.size());
    static_cast<void>(assembly.add(6000, false, *parse_datagram(parts[0]), packet.size()));
  }
  EXPECT_TRUE(complete);
}

TEST_F(Receiving, AFloodFromOneSenderDoesNotShutOutAnother) {
  for (int i = 0; i < 10'000; ++i) {
    take({short_datagram("BIG", Packet(50'000))}, 66);
    take({short_datagram("SMALL", Packet(10))}, 66);
  }
  EXPECT_GT(intake_.rejections().crowded_out, 0);
  take({short_datagram("SMALL", Packet(7)), short_datagram("BIG", Packet(200))}, 1);
  std::size_t ours = 0;
  std::size_t bytes = 0;
  for (const Arrival& arrival : arrivals(intake_)) {
    ours += arrival.sender.id == 1 ? 1 : 0;
    bytes += arrival.packet.size();
  }
  EXPECT_EQ(ours, 2U);
  EXPECT_LE(bytes, ArrivalQueue::kMaxBytes);
}

TEST_F(Receiving, NoDatagramDoesHarm) {
  std::mt19937 random(3);
  Intake keyed(new_key(), 4);
  keyed.subscribe("BIG", kMax, Access::kAnyone);
  const std::vector<Bytes> real = fragments("BIG", counted(500), 200);
  for (int i = 0; i < 300'000; ++i) {
    Bytes bytes = real[random() % real.size()];
    if (random() % 8 == 0) bytes.resize(random() % 300);
    for (auto changes = random() % 5; changes > 0 && !bytes.empty(); --changes) {
      bytes[random() % std::min<std::size_t>(bytes.size(), 28)] =
          static_cast<std::uint8_t>(random() % 3 == 0 ? 0xFF : random());
    }
    intake_.take(bytes, random() % 40, i);
    keyed.take(bytes, random() % 40, i);
    if (i % 100 == 0) {
      static_cast<void>(arrivals(intake_));
      for (const Arrival& arrival : arrivals(keyed)) {
        EXPECT_EQ(arrival.sender.trust, Trust::kAnonymous);
      }
    }
  }
}

// --- authentication ---

TEST(Envelope, IsForOneChannelOneSenderAndOneNumber) {
  const Key key = new_key();
  const Trailer trailer{Role::kVehicle, 0x0123456789ABCDEF, 42};
  Packet packet = counted(80);
  seal(key, channel::kDepth, trailer, packet);
  ASSERT_EQ(packet.size(), 80 + kTrailerSize);
  EXPECT_TRUE(std::ranges::equal(without_trailer(packet), counted(80)));
  const auto opened = authenticate(key, channel::kDepth, packet);
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->role, Role::kVehicle);
  EXPECT_EQ(opened->sender, trailer.sender);
  EXPECT_EQ(opened->counter, 42U);
  EXPECT_FALSE(authenticate(key, channel::kHealth, packet));
  EXPECT_FALSE(authenticate(new_key(), channel::kDepth, packet));
  EXPECT_FALSE(authenticate(key, channel::kDepth, without_trailer(packet)));
  EXPECT_FALSE(authenticate(key, channel::kDepth, {}));
}

RC_GTEST_PROP(Envelope, NoChangedBitIsAccepted, ()) {
  static const Key key = new_key();
  Packet packet = counted(*rc::gen::inRange<std::size_t>(0, 200));
  seal(key, "A", {Role::kExecutive, 3, 4}, packet);
  const auto at = *rc::gen::inRange<std::size_t>(0, 8 * packet.size());
  packet[at / 8] ^= static_cast<std::uint8_t>(1U << (at % 8));
  RC_ASSERT(!authenticate(key, "A", packet));
}

TEST(Envelope, ChannelsBelongToRoles) {
  EXPECT_TRUE(may_publish(Role::kSupervisor, channel::kCommand));
  EXPECT_FALSE(may_publish(Role::kTopside, channel::kCommand));
  EXPECT_FALSE(may_publish(Role::kVehicle, channel::kHeartbeat));
  EXPECT_FALSE(may_publish(Role::kExecutive, channel::kDepth));
  EXPECT_FALSE(may_publish(Role::kObserver, channel::kRequest));
  EXPECT_TRUE(may_publish(Role::kTopside, channel::kRequest));
  EXPECT_TRUE(may_publish(Role::kObserver, "WEATHER"));
}

// A process with the key, without a network.
class Process {
 public:
  Process(const Key& key, Role role, std::uint64_t id)
      : key_(key), trailer_{role, id, 0}, intake(key, id) {}

  Bytes send(const char* channel, Packet packet) {
    ++trailer_.counter;
    seal(key_, channel, trailer_, packet);
    return short_datagram(channel, packet);
  }
  /// Empty if none is due.
  Bytes presence(Utime now) {
    const std::optional<Presence> due = intake.take_presence(now);
    Packet packet;
    return due && encode(*due, packet) ? send(channel::kPresence, packet) : Bytes();
  }
  void take(const Bytes& datagram, Utime now) { intake.take(datagram, trailer_.sender, now); }

 private:
  Key key_;
  Trailer trailer_;

 public:
  Intake intake;
};

class WithKey : public ::testing::Test {
 protected:
  WithKey() { executive_.intake.subscribe(channel::kDepth, 100, Access::kAuthentic); }

  /// Exchanges presences for `duration`; the vehicle is also called at each.
  void exchange(Process& vehicle, Utime duration) {
    for (const Utime end = now_ + duration; now_ < end; now_ += 10'000) {
      const Bytes ours = executive_.presence(now_);
      if (!ours.empty()) vehicle.take(ours, now_);
      const Bytes theirs = vehicle.presence(now_);
      if (theirs.empty()) continue;
      executive_.take(theirs, now_);
      recorded_.push_back(theirs);
    }
  }
  /// True if the executive delivers it.
  bool accepts(const Bytes& datagram) {
    executive_.take(datagram, now_);
    return !arrivals(executive_.intake).empty();
  }

  Key key_ = new_key();
  Process executive_{key_, Role::kExecutive, 1};
  Process vehicle_{key_, Role::kVehicle, 2};
  Utime now_ = kSecond;
  std::vector<Bytes> recorded_;  ///< The vehicle's presences.
};

TEST_F(WithKey, ASenderIsConfirmedWithinAFewPresences) {
  EXPECT_FALSE(accepts(vehicle_.send(channel::kDepth, Packet(9))));
  EXPECT_EQ(executive_.intake.rejections().unconfirmed, 1);
  exchange(vehicle_, 60'000);
  EXPECT_TRUE(accepts(vehicle_.send(channel::kDepth, Packet(9))));
  exchange(vehicle_, 20 * kSecond);
  EXPECT_TRUE(accepts(vehicle_.send(channel::kDepth, Packet(9)))) << "and stays so";
}

TEST_F(WithKey, NothingForgedRepeatedOrOlderIsAccepted) {
  exchange(vehicle_, kSecond);
  Process stranger(new_key(), Role::kVehicle, 3);
  Process topside(key_, Role::kTopside, 4);
  exchange(topside, kSecond);
  exchange(vehicle_, kSecond);
  std::vector<Bytes> sent;
  for (int i = 0; i < 1000; ++i) sent.push_back(vehicle_.send(channel::kDepth, Packet(9)));
  EXPECT_TRUE(accepts(sent[500]));
  for (int i = 0; i <= 500; ++i) EXPECT_FALSE(accepts(sent[i])) << "older, or repeated";
  for (int i = 0; i < 1000; ++i) {
    EXPECT_FALSE(accepts(short_datagram(channel::kDepth, Packet(9)))) << "without a code";
    EXPECT_FALSE(accepts(stranger.send(channel::kDepth, Packet(9)))) << "with another key";
    EXPECT_FALSE(accepts(topside.send(channel::kDepth, Packet(9)))) << "from another role";
    EXPECT_FALSE(accepts(executive_.send(channel::kDepth, Packet(9)))) << "from itself";
  }
  EXPECT_TRUE(accepts(sent[501]));
  EXPECT_EQ(executive_.intake.rejections().repeated, 501);
  EXPECT_EQ(executive_.intake.rejections().unauthenticated, 4000);
}

TEST_F(WithKey, ARecordedSessionIsNotAcceptedByOneThatHasJustStarted) {
  exchange(vehicle_, kSecond);
  std::vector<Bytes> recording = recorded_;
  for (int i = 0; i < 100; ++i) recording.push_back(vehicle_.send(channel::kDepth, Packet(9)));
  Process restarted(key_, Role::kExecutive, 9);
  restarted.intake.subscribe(channel::kDepth, 100, Access::kAuthentic);
  for (int again = 0; again < 3; ++again) {
    for (const Bytes& datagram : recording) {
      now_ += 20'000;
      static_cast<void>(restarted.presence(now_));
      restarted.take(datagram, now_);
    }
  }
  EXPECT_TRUE(arrivals(restarted.intake).empty());
}

TEST_F(WithKey, WhatIsHeldBackIsNotAcceptedLater) {
  exchange(vehicle_, kSecond);
  const Bytes held = vehicle_.send(channel::kDepth, Packet(9));
  exchange(vehicle_, 2 * Peers::kPeriod);
  EXPECT_FALSE(accepts(held)) << "the sender's presence is newer";
  const Bytes last = vehicle_.send(channel::kDepth, Packet(9));
  now_ += Peers::kLifetime + kSecond;
  EXPECT_FALSE(accepts(last)) << "the sender is gone";
}

TEST_F(WithKey, AProcessThatWasStoppedTakesNothingOldAndIsSoonBack) {
  exchange(vehicle_, kSecond);
  const Bytes before = vehicle_.send(channel::kDepth, Packet(9));
  now_ += 10 * kSecond;  // the executive does not run, its socket fills
  EXPECT_FALSE(accepts(before));
  exchange(vehicle_, 600'000);
  EXPECT_TRUE(accepts(vehicle_.send(channel::kDepth, Packet(9))));
}

TEST_F(WithKey, LostPresencesDoNotDisturb) {
  exchange(vehicle_, kSecond);
  std::mt19937 random(5);
  int refused = 0;
  for (int i = 0; i < 3000; ++i, now_ += 20'000) {
    const Bytes from_executive = executive_.presence(now_);
    const Bytes from_vehicle = vehicle_.presence(now_);
    if (!from_executive.empty() && random() % 5 != 0) vehicle_.take(from_executive, now_);
    if (!from_vehicle.empty() && random() % 5 != 0) executive_.take(from_vehicle, now_);
    refused += accepts(vehicle_.send(channel::kDepth, Packet(9))) ? 0 : 1;
  }
  EXPECT_LT(refused, 30) << "of a minute";
}

TEST_F(WithKey, AFloodOfOldPresencesDoesNotShutOutTheLiving) {
  std::vector<Bytes> old;
  for (std::uint64_t id = 100; id < 700; ++id) {
    old.push_back(Process(key_, Role::kVehicle, id).presence(now_));
  }
  exchange(vehicle_, kSecond);
  for (int i = 0; i < 200; ++i, now_ += 10'000) {
    for (const Bytes& datagram : old) executive_.take(datagram, now_);
    exchange(vehicle_, 10'000);
    EXPECT_TRUE(accepts(vehicle_.send(channel::kDepth, Packet(9))));
  }
}

TEST_F(WithKey, AnonymousRequestsHaveAnAllowanceOfTheirOwn) {
  executive_.intake.subscribe(channel::kRequest, 100, Access::kAnyone);
  Process topside(key_, Role::kTopside, 4);
  exchange(topside, kSecond);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    executive_.intake.take(short_datagram(channel::kRequest, Packet(9)), 1000 + i, now_);
  }
  executive_.take(topside.send(channel::kRequest, Packet(9)), now_);
  std::size_t anonymous = 0;
  std::size_t authentic = 0;
  for (const Arrival& arrival : arrivals(executive_.intake)) {
    anonymous += arrival.sender.trust == Trust::kAnonymous ? 1 : 0;
    authentic += arrival.sender.trust == Trust::kAuthentic ? 1 : 0;
  }
  EXPECT_EQ(anonymous, Intake::kAnonymousQueue);
  EXPECT_EQ(authentic, 1U);
}

TEST(Intake, WithoutAKeyATrailerIsCutOff) {
  Intake observer(std::nullopt, 5);
  observer.subscribe(channel::kDepth, 100, Access::kAuthentic);
  Process vehicle(new_key(), Role::kVehicle, 2);
  observer.take(vehicle.send(channel::kDepth, counted(9)), kAddress, 0);
  const auto received = arrivals(observer);
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].packet, counted(9));
}

}  // namespace
}  // namespace dive::link
