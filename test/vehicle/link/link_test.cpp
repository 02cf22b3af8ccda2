// The link without processes: packets, requests, arbitration, clocks.

#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "test/common/allocations.h"
#include "vehicle/link/authority.h"
#include "vehicle/link/key.h"
#include "vehicle/link/sample_clock.h"

namespace dive::link {
namespace {

namespace fs = std::filesystem;

constexpr Utime kSecond = kMicrosecondsPerSecond;

OperatorRequest request(std::uint64_t session_id, std::int64_t counter, OperatorCommand command,
                        std::uint64_t challenge = 0) {
  return {session_id, counter, challenge, command};
}

// --- packets ---

struct Kind {
  std::string name;
  Packet packet;
  std::function<bool(PacketView)> decodes;
};

template <typename Value>
Kind kind(const char* name, const Value& value) {
  Packet packet;
  EXPECT_TRUE(encode(value, packet)) << name;
  return {name, packet, [](PacketView view) {
            Value decoded;
            return decode(view, decoded);
          }};
}

std::vector<Kind> kinds() {
  Path path{7, 0.6, std::vector<Pose>(3)};
  return {kind("imu", ImuSample{}),
          kind("depth", DepthSample{}),
          kind("health", HealthSample{}),
          kind("truth", Truth{5, {}, {"rock", "wall"}, 0.25, "wall"}),
          kind("command", VehicleCommand{}),
          kind("sim tick", SimTick{5, 3, std::nullopt, 4, 5, 5, std::nullopt, 4, 3}),
          kind("heartbeat", Heartbeat{}),
          kind("request", request(1, 2, OperatorCommand::kSkip)),
          kind("answer", OperatorAnswer{}),
          kind("presence", Presence{7, {{1, 2}, {3, 4}}}),
          kind("image",
               ImageFrame{3, 1, ImageFrame::Format::kRgb8, 2, 2, std::vector<std::uint8_t>(12, 7)}),
          kind("range", RangeScan{4, {0.3F, 0, 0}, 10.0F, {{1, 2, 3}, {4, 5, 6}}}),
          kind("path", path),
          kind("exit path", ExitPathMessage{3, {.revision = 2, .waypoints = path.waypoints}})};
}

TEST(LinkCodec, AcceptsWholePacketsOnly) {
  for (const Kind& k : kinds()) {
    EXPECT_TRUE(k.decodes(k.packet)) << k.name;
    for (std::size_t cut = 0; cut < k.packet.size(); ++cut) {
      EXPECT_FALSE(k.decodes(PacketView(k.packet).first(cut))) << k.name << " cut at " << cut;
    }
    Packet longer = k.packet;
    longer.push_back(0);
    EXPECT_FALSE(k.decodes(longer)) << k.name;
    for (const Kind& other : kinds()) {
      EXPECT_EQ(k.decodes(other.packet), other.name == k.name) << k.name << other.name;
    }
  }
}

TEST(LinkCodec, SurvivesGarbageWithoutBelievingItsLengths) {
  std::mt19937 random(7);
  for (const Kind& k : kinds()) {
    for (int i = 0; i < 20'000; ++i) {
      Packet packet = k.packet;
      for (unsigned changes = 1 + random() % 4; changes > 0; --changes) {
        packet[random() % packet.size()] = static_cast<std::uint8_t>(random());
      }
      if (random() % 4 == 0) packet.resize(random() % (2 * packet.size()));
      dive::testing::reset_allocations();
      EXPECT_NO_THROW(static_cast<void>(k.decodes(packet))) << k.name;
      EXPECT_LE(dive::testing::allocations().largest, 2 * packet.size() + 64) << k.name;
    }
  }
}

TEST(LinkCodec, KeepsEveryBitOfACommand) {
  VehicleCommand command{123, 45, Source::kSupervisor, Mode::kDepthAndAngles, {}, {}};
  command.command = {0.4, 0.0, 3.25, from_rpy(0.1, -0.2, 3.0)};
  command.rates = {0.1, -0.2, 0.3, -0.4, 0.5};
  Packet packet;
  VehicleCommand back;
  ASSERT_TRUE(encode(command, packet) && decode(packet, back));
  EXPECT_EQ(back.utime, 123);
  EXPECT_EQ(back.sequence, 45);
  EXPECT_EQ(back.source, Source::kSupervisor);
  EXPECT_EQ(back.mode, Mode::kDepthAndAngles);
  EXPECT_EQ(back.command.o.coeffs(), command.command.o.coeffs());
  EXPECT_EQ(back.command.d, 3.25);
  EXPECT_EQ(back.rates.yaw, 0.5);
  EXPECT_EQ(back.rates.heave, -0.2);
}

TEST(LinkCodec, AFrameIsAsLargeAsItSays) {
  const ImageFrame gray{3, 2, ImageFrame::Format::kGray8, 3, 2, {1, 2, 3, 4, 5, 6}};
  Packet packet;
  ImageFrame back;
  ASSERT_TRUE(encode(gray, packet) && decode(packet, back));
  EXPECT_EQ(back.pixels, gray.pixels);
  EXPECT_EQ(back.width, 3);
  EXPECT_EQ(back.camera, 2);
  for (const auto& spoil : std::vector<std::function<void(ImageFrame&)>>{
           [](ImageFrame& f) { f.width = 2; }, [](ImageFrame& f) { f.camera = 3; },
           [](ImageFrame& f) { f.height = 0; }, [](ImageFrame& f) { f.pixels.clear(); },
           [](ImageFrame& f) { f.format = ImageFrame::Format::kRgb8; }}) {
    ImageFrame spoilt = gray;
    spoil(spoilt);
    EXPECT_FALSE(encode(spoilt, packet));
  }
}

TEST(LinkCodec, KnowsHowLargeThePacketOfAFrameIs) {
  ImageFrame frame{1, 0, ImageFrame::Format::kGray8, 752, 480, {}};
  frame.pixels.resize(752 * 480);
  Packet packet;
  ASSERT_TRUE(encode(frame, packet));
  EXPECT_EQ(packet.size(), image_packet_size(frame.pixels.size()));
}

TEST(LinkCodec, KnowsHowLargeItsLongestListsAre) {
  Packet packet;
  ExitPathMessage exit;
  exit.path.waypoints.resize(vehicle::kMaxExitWaypoints);
  ASSERT_TRUE(encode(exit, packet));
  EXPECT_EQ(packet.size(), kMaxExitPathPacket);
  Presence presence;
  presence.echoes.resize(kMaxEchoes);
  ASSERT_TRUE(encode(presence, packet));
  EXPECT_EQ(packet.size(), kMaxPresencePacket);
  Truth truth;
  truth.nearest.assign(kMaxObstacleName - 1, 'x');
  truth.contacts.assign(kMaxContacts, truth.nearest);
  ASSERT_TRUE(encode(truth, packet));
  EXPECT_EQ(packet.size(), kMaxTruthPacket);
}

TEST(LinkCodec, ATickSaysHowManyInertialSamplesItHas) {
  Packet packet;
  SimTick tick{8, std::nullopt, 6, std::nullopt, std::nullopt, std::nullopt, 8, 4, 7};
  SimTick back;
  ASSERT_TRUE(encode(tick, packet) && decode(packet, back));
  EXPECT_EQ(back.right, 8);
  EXPECT_FALSE(back.left);
  EXPECT_EQ(back.imu_samples, 4);
  EXPECT_EQ(back.last_imu, 7);
  packet[packet.size() - 9] = 0xFF;  // number of samples: -1
  EXPECT_FALSE(decode(packet, back));
  packet[packet.size() - 9] = 0;  // no samples, but with a time
  EXPECT_FALSE(decode(packet, back));
  tick.imu_samples = 128;
  EXPECT_FALSE(encode(tick, packet));
}

TEST(LinkCodec, KeepsEveryBitOfAScan) {
  // The bits of a NaN survive too: it marks a ray without a range.
  const auto nan = std::bit_cast<float>(std::uint32_t{0xFFC12345});
  const RangeScan scan{
      9, {0.31F, -0.0F, 1e-40F}, 10.0F, {{1.5F, -2.25F, nan}, {nan, nan, nan}, {20, 0, -0.0F}}};
  Packet packet;
  RangeScan back;
  ASSERT_TRUE(encode(scan, packet) && decode(packet, back));
  EXPECT_EQ(back.utime, 9);
  EXPECT_EQ(back.reach, 10.0F);
  EXPECT_EQ(std::memcmp(&back.origin_B, &scan.origin_B, sizeof scan.origin_B), 0);
  ASSERT_EQ(back.points_B.size(), 3U);
  EXPECT_EQ(std::memcmp(back.points_B.data(), scan.points_B.data(), 3 * sizeof scan.points_B[0]),
            0);
}

TEST(LinkCodec, TakesNoScanWithoutOriginReachOrBound) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  RangeScan scan;
  Packet packet;
  scan.points_B.resize(kMaxScanPoints);
  EXPECT_TRUE(encode(scan, packet));
  EXPECT_EQ(packet.size(), kMaxScanPacket);
  scan.points_B.emplace_back();
  EXPECT_FALSE(encode(scan, packet));
  scan.points_B.clear();
  ASSERT_TRUE(encode(scan, packet));
  // Written by another program: LCM's floats are big-endian; the origin follows fingerprint and
  // time, then the reach, then the count of values.
  const auto decodes = [&](std::size_t at, auto value) {
    Packet spoilt = packet;
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (std::size_t i = 0; i < 4; ++i) {
      spoilt[at + i] = static_cast<std::uint8_t>(bits >> (8 * (3 - i)));
    }
    if (at == 32) spoilt.resize(36 + 4 * bits);
    RangeScan back;
    return decode(spoilt, back);
  };
  EXPECT_TRUE(decodes(16, 1.0F));
  EXPECT_FALSE(decodes(16, nan));
  EXPECT_FALSE(decodes(24, -inf));
  EXPECT_TRUE(decodes(28, 1000.0F));
  for (const float reach : {0.0F, -1.0F, nan, inf, 1000.5F}) EXPECT_FALSE(decodes(28, reach));
  EXPECT_TRUE(decodes(32, 3));
  EXPECT_FALSE(decodes(32, 4)) << "no whole point";
}

// --- operator requests ---

// The session is 1; challenges are 2, 3, ...
RequestAuthenticator authenticator_with(RequestPolicy policy) {
  return RequestAuthenticator(policy, [nonce = std::uint64_t{0}]() mutable { return ++nonce; });
}

TEST(RequestAuthenticator, ActsOnARequestOnceAndAnswersItsRepetition) {
  RequestAuthenticator authenticator = authenticator_with({.has_key = true});
  OperatorRequest skip = request(1, 1, OperatorCommand::kSkip, authenticator.challenge(0));
  EXPECT_TRUE(authenticator.evaluate(skip, Trust::kAuthentic, kSecond).act);
  skip.challenge = authenticator.challenge(2 * kSecond);
  const auto again = authenticator.evaluate(skip, Trust::kAuthentic, 2 * kSecond);
  EXPECT_FALSE(again.act);
  ASSERT_TRUE(again.answer);
  EXPECT_EQ(again.answer->result, RequestResult::kAccepted);
  EXPECT_EQ(authenticator.counter(), 1);
}

TEST(RequestAuthenticator, RefusesWhatIsForgedRepeatedOrPreparedAndCounts) {
  RequestAuthenticator authenticator = authenticator_with({.has_key = true});
  const auto result_of = [&](const OperatorRequest& sent, Trust trust, Utime now) {
    const RequestAuthenticator::Decision decision = authenticator.evaluate(sent, trust, now);
    EXPECT_EQ(decision.act, decision.answer->result == RequestResult::kAccepted);
    return decision.answer->result;
  };
  const auto pause = OperatorCommand::kPause;
  const auto authentic = Trust::kAuthentic;
  const std::uint64_t first = authenticator.challenge(0);
  EXPECT_EQ(result_of(request(1, 1, pause, first), Trust::kAnonymous, 0),
            RequestResult::kAuthFailed);
  EXPECT_EQ(result_of(request(9, 1, pause, first), authentic, 0), RequestResult::kReplayed)
      << "another start";
  EXPECT_EQ(result_of(request(1, 5, pause, first), authentic, 0), RequestResult::kAccepted);
  EXPECT_EQ(result_of(request(1, 5, OperatorCommand::kSkip, first), authentic, 0),
            RequestResult::kReplayed);
  EXPECT_EQ(result_of(request(1, 4, pause, first), authentic, 0), RequestResult::kReplayed);
  EXPECT_EQ(result_of(request(1, 6, pause, 77), authentic, 0), RequestResult::kStale)
      << "prepared before the challenge was known";
  const std::uint64_t second = authenticator.challenge(2 * kSecond);
  EXPECT_EQ(result_of(request(1, 6, pause, first), authentic, 3 * kSecond),
            RequestResult::kAccepted);
  EXPECT_EQ(result_of(request(1, 7, pause, first), authentic, 4 * kSecond), RequestResult::kStale)
      << "kept for four seconds";
  EXPECT_EQ(result_of(request(1, 7, pause, second), authentic, 9 * kSecond), RequestResult::kStale)
      << "no heartbeat was sent meanwhile";
  EXPECT_EQ(authenticator.refused().auth_failed, 1);
  EXPECT_EQ(authenticator.refused().replayed, 3);
  EXPECT_EQ(authenticator.refused().stale, 3);
}

TEST(RequestAuthenticator, ASenderThatIsNotConfirmedGetsNoAnswer) {
  RequestAuthenticator authenticator = authenticator_with({.has_key = true});
  const auto decision = authenticator.evaluate(
      request(1, 1, OperatorCommand::kSkip, authenticator.challenge(0)), Trust::kUnconfirmed, 0);
  EXPECT_FALSE(decision.act);
  EXPECT_FALSE(decision.answer);
}

TEST(RequestAuthenticator, WithoutAKeyNothingButAnAbortIsAccepted) {
  RequestAuthenticator authenticator = authenticator_with({.has_key = false});
  for (const auto command : {OperatorCommand::kHeartbeat, OperatorCommand::kPause,
                             OperatorCommand::kResume, OperatorCommand::kSkip}) {
    EXPECT_EQ(authenticator.evaluate(request(1, 1, command), Trust::kAnonymous, 0).answer->result,
              RequestResult::kNoKey);
  }
  const OperatorRequest abort = request(0, 0, OperatorCommand::kAbort);
  EXPECT_TRUE(authenticator.evaluate(abort, Trust::kAnonymous, 0).act);
}

TEST(RequestAuthenticator, WhereTheMissionSaysSoAnAbortNeedsTheKey) {
  RequestAuthenticator authenticator =
      authenticator_with({.has_key = true, .abort_needs_key = true});
  const OperatorRequest abort = request(0, 0, OperatorCommand::kAbort);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(authenticator.evaluate(abort, Trust::kAnonymous, 0).answer->result,
              RequestResult::kAuthFailed);
    EXPECT_FALSE(authenticator.evaluate(abort, Trust::kUnconfirmed, 0).answer);
  }
  const auto decision = authenticator.evaluate(abort, Trust::kAuthentic, 0);
  EXPECT_TRUE(decision.act) << "before its sender has received a heartbeat";
  EXPECT_EQ(decision.answer->result, RequestResult::kAccepted);
}

TEST(RequestAuthenticator, AFloodOfAbortsIsActedOnNowAndThen) {
  RequestAuthenticator authenticator = authenticator_with({.has_key = true});
  int acted = 0;
  for (int i = 0; i < 1000; ++i) {  // ten a second, each a new one
    const auto decision = authenticator.evaluate(request(1, i, OperatorCommand::kAbort),
                                                 Trust::kAnonymous, i * kSecond / 10);
    acted += decision.act ? 1 : 0;
    EXPECT_EQ(decision.answer->result, RequestResult::kAccepted) << "an abort is never refused";
  }
  EXPECT_GE(acted, 10);
  EXPECT_LE(acted, 13);
  EXPECT_EQ(authenticator.refused().rate_limited, 1000 - acted);
}

TEST(KeyFile, IsItsOwnersAlone) {
  const fs::path path = fs::path(::testing::TempDir()) / "dive-link.key";
  fs::remove(path);
  const Key key = new_key();
  ASSERT_TRUE(write_key(path.string(), key));
  EXPECT_EQ(read_key(path.string()), key);
  EXPECT_FALSE(write_key(path.string(), key)) << "an old key is not overwritten";
  fs::permissions(path, fs::perms::group_read, fs::perm_options::add);
  EXPECT_NE(read_key(path.string()).error().find("chmod 600"), std::string::npos);
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  std::ofstream(path) << "0123456789abcdef\n";
  EXPECT_NE(read_key(path.string()).error().find("64 hexadecimal digits"), std::string::npos);
  fs::remove(path);
  EXPECT_NE(read_key(path.string()).error().find("cannot read"), std::string::npos);
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  EXPECT_NE(read_key(path.string()).error().find("not a regular file"), std::string::npos);
  fs::remove(path);
}

// --- clocks ---

TEST(SampleClock, KeepsTheOrderOfPacketsAndTheAgeOfSamples) {
  SampleClock clock;
  const Utime boot = 1'700'000'000 * kSecond;  // the sensor's clock gives the time of day
  EXPECT_EQ(clock.ours(boot, 5 * kSecond), 5 * kSecond);
  EXPECT_EQ(clock.ours(boot + 40'000, 5 * kSecond + 50'000), 5 * kSecond + 40'000);
  EXPECT_EQ(clock.ours(boot + 20'000, 5 * kSecond + 55'000), 5 * kSecond + 20'000) << "reordered";
  EXPECT_EQ(clock.ours(boot + 80'000, 5 * kSecond + 70'000), 5 * kSecond + 70'000) << "quicker";
  EXPECT_EQ(clock.jumps(), 0);
}

TEST(SampleClock, IsFollowedByOtherSensorsThatNeverSetIt) {
  SampleClock clock;
  EXPECT_FALSE(clock.follow(0, 0)) << "it has not spoken yet";
  EXPECT_EQ(clock.ours(kSecond, kSecond + 20'000), kSecond + 20'000);
  EXPECT_EQ(clock.follow(kSecond, kSecond + 90'000), kSecond + 20'000);
  EXPECT_EQ(clock.follow(kSecond + 60'000, kSecond + 60'000), kSecond + 60'000) << "quicker";
  EXPECT_EQ(clock.ours(kSecond + 60'000, kSecond + 80'000), kSecond + 60'000);
  for (const Utime jump : {-kSecond, kSecond, Utime{1} << 62, -(Utime{1} << 62)}) {
    EXPECT_FALSE(clock.follow(2 * kSecond + jump, 2 * kSecond)) << jump;
  }
  EXPECT_EQ(clock.ours(2 * kSecond, 2 * kSecond), 2 * kSecond);
  EXPECT_EQ(clock.jumps(), 0);
}

TEST(SampleClock, IsSetAnewWhenTheirsJumps) {
  for (const Utime jump : {-3600 * kSecond, 3600 * kSecond, Utime{1} << 62, -(Utime{1} << 62)}) {
    SampleClock clock;
    static_cast<void>(clock.ours(0, 0));
    EXPECT_EQ(clock.ours(kSecond + jump, kSecond), kSecond);
    EXPECT_EQ(clock.jumps(), 1) << jump;
    EXPECT_EQ(clock.ours(2 * kSecond + jump, 2 * kSecond + 1000),
              2 * kSecond + (std::abs(jump) > (Utime{1} << 61) ? 1000 : 0));
  }
}

}  // namespace
}  // namespace dive::link
