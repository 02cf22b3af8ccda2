// The codec against forged packets. Cases that the log tests cover are not repeated here.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "mission/record/log_codec.h"
#include "mission/record/log_digest.h"
#include "test/common/allocations.h"
#include "test/mission/record/sample.h"
#include "vehicle/link/packet_layout.h"

namespace dive::mission::testing {
namespace {

/// A packet of each type, and its decoder.
struct Kind {
  std::string name;
  Packet packet;
  std::function<bool(PacketView)> decodes;
};

template <typename Value, typename... Before>
Kind kind(const char* name, const Value& value, Before... before) {
  Packet packet;
  EXPECT_TRUE(encode(before..., value, packet)) << name;
  return {name, packet, [](PacketView view) {
            Value decoded;
            return decode(view, decoded);
          }};
}

std::vector<Kind> kinds() {
  PlanReply reply;
  reply.plan.reason = "wall";
  reply.plan.reduced = {.obstacle = "rock"};
  reply.plan.waypoints.resize(3);
  PlanQuery query;
  query.state = "swim";
  query.request.previous.resize(2);
  query.request.trail.resize(3);
  planning::Polytope piece;
  piece.vertices.resize(4);
  const planning::ObstacleUpdate update{
      planning::ObstacleSource::kScript, 3, {{-1, {piece, piece}}, {7, {}}, {8, {piece}}}};
  const Utime now = 5;
  return {kind("header", sample_header()),
          kind("imu", ImuSample{}),
          kind("depth", DepthSample{}),
          kind("health", HealthSample{}),
          kind("estimate", estimation::StateEstimate{}),
          kind("truth", TruthRecord{5, {}, {"rock", "wall/body/shape"}, 0.25, "wall"}),
          kind("tick", TickMark{}),
          kind("plan reply", reply, now),
          kind("command", vehicle::Command{}, now),
          kind("rates", vehicle::PseudoRates{}, now),
          kind("status", Status{}, now),
          kind("plan query", query, now),
          kind("transition", TransitionRecord{"a", "b", "c", "d", "e"}, now),
          kind("failsafe", FailsafeRecord{"a", "b", "c", "d"}, now),
          kind("action", ActionRecord{}, now),
          kind("operator", OperatorCommand::kPause, now),
          kind("obstacles", update, now),
          kind("free ahead", planning::FreeAhead{3, 2.5}, now),
          kind("obstacle ahead", planning::ObstacleAhead{3, 1.2, {0.6, 0.1, -0.05}}, now),
          kind("pose correction", planning::PoseCorrection{3, {0.1, -0.2}}, now),
          kind("map correction", MapCorrection{{{1, {0.1, {0.2, 0.3}}}, {2, {}}}}, now),
          kind("map fix", MapFix{}, now),
          kind("vision", estimation::VisionEstimate{}, now)};
}

TEST(Codec, AcceptsWholePacketsOnly) {
  for (const Kind& k : kinds()) {
    EXPECT_TRUE(k.decodes(k.packet)) << k.name;
    for (std::size_t cut = 0; cut < k.packet.size(); ++cut) {
      EXPECT_FALSE(k.decodes(PacketView(k.packet).first(cut))) << k.name << " cut at " << cut;
    }
    Packet longer = k.packet;
    longer.push_back(0);
    EXPECT_FALSE(k.decodes(longer)) << k.name;
    Packet stranger = k.packet;
    stranger[3] ^= 1U;  // Within the fingerprint.
    EXPECT_FALSE(k.decodes(stranger)) << k.name;
  }
}

TEST(Codec, NoForgedLengthIsBelieved) {
  for (const Kind& k : kinds()) {
    for (const std::uint32_t forged : {0x7fffffffU, 0x80000000U, 0xffffffffU, 0x00ffffffU, 0U}) {
      for (std::size_t at = 8; at + 4 <= k.packet.size(); ++at) {
        Packet packet = k.packet;
        for (std::size_t i = 0; i < 4; ++i) {
          packet[at + i] = static_cast<std::uint8_t>(forged >> (24U - 8U * i));
        }
        dive::testing::reset_allocations();
        EXPECT_NO_THROW((void)k.decodes(packet)) << k.name;
        EXPECT_LE(dive::testing::allocations().largest, 2 * packet.size() + 64)
            << k.name << " at " << at;
      }
    }
  }
}

TEST(Codec, ConstantsOutOfRangeAreRefused) {
  const auto refused_values = [](const Kind& k, std::size_t at) {
    std::string refused;
    for (const int value : {-128, -1, 0, 1, 2, 3, 4, 5, 127}) {
      Packet packet = k.packet;
      packet.at(at) = static_cast<std::uint8_t>(value);
      if (!k.decodes(packet)) refused += fmt::format("{} ", value);
    }
    return refused;
  };
  const std::vector<Kind> all = kinds();
  const auto named = [&](const char* name) { return *std::ranges::find(all, name, &Kind::name); };
  constexpr std::size_t kTime = 8 + 8;  // Offset after the fingerprint and utime.
  EXPECT_EQ(refused_values(named("health"), kTime + 32), "-128 -1 2 3 4 5 127 ");       // leak
  EXPECT_EQ(refused_values(named("estimate"), kTime), "-128 -1 2 3 4 5 127 ");          // valid
  EXPECT_EQ(refused_values(named("estimate"), kTime + 1), "-128 -1 2 3 4 5 127 ");      // source
  EXPECT_EQ(refused_values(named("plan reply"), kTime + 8), "-128 -1 4 5 127 ");        // status
  EXPECT_EQ(refused_values(named("plan reply"), kTime + 9), "-128 -1 2 3 4 5 127 ");    // accepted
  EXPECT_EQ(refused_values(named("plan query"), kTime + 128), "-128 -1 2 3 4 5 127 ");  // fixed
  EXPECT_EQ(refused_values(named("plan query"), kTime + 129), "-128 -1 3 4 5 127 ");    // attitude
  const Kind status = named("status");
  EXPECT_EQ(refused_values(named("operator"), kTime), "-128 -1 127 ");                  // command
  EXPECT_EQ(refused_values(named("obstacles"), kTime + 8), "-128 -1 3 4 5 127 ");       // source
  EXPECT_EQ(refused_values(named("action"), kTime), "-128 -1 3 4 5 127 ");              // kind
  EXPECT_EQ(refused_values(status, status.packet.size() - 1), "-128 -1 2 3 4 5 127 ");  // finished
}

// Forged counts that add up to the packet's size, but do not agree with each other.
TEST(Codec, PiecesOfAnObstacleUpdateAreNeitherSharedNorLeftOver) {
  const std::vector<Kind> all = kinds();
  const Kind k = *std::ranges::find(all, "obstacles", &Kind::name);
  // Offset of the counts of pieces, by cell.
  constexpr std::size_t kCounts = 8 + 8 + 8 + 1 + 4 + 3 * 8;
  constexpr std::size_t kVertices = kCounts + 3 * 4 + 4 + 3 * 8;
  for (const auto& [at, value] : {std::pair<std::size_t, int>{kCounts + 3, 1},
                                  {kCounts + 3, 3},
                                  {kVertices + 3, 0},
                                  {kVertices + 3, 3},
                                  {kVertices + 3, 5},
                                  {kVertices + 3, 17},
                                  {kVertices, 255}}) {
    Packet packet = k.packet;
    ASSERT_NE(packet.at(at), value);
    packet.at(at) = static_cast<std::uint8_t>(value);
    EXPECT_FALSE(k.decodes(packet)) << at << " " << value;
  }
}

TEST(Codec, WhatCannotBeRepresentedIsNotEncoded) {
  Packet packet;
  PlanReply reply;
  reply.plan.reason.assign(kMaxText - 1, 'x');
  reply.plan.reduced = {.obstacle = reply.plan.reason};
  reply.plan.waypoints.resize(kMaxWaypoints);
  EXPECT_TRUE(encode(0, reply, packet));
  reply.plan.waypoints.resize(kMaxWaypoints + 1);
  EXPECT_FALSE(encode(0, reply, packet));
  reply.plan.waypoints.clear();
  reply.plan.reason += 'x';
  EXPECT_FALSE(encode(0, reply, packet));

  planning::Polytope point;
  point.vertices.resize(1);
  const auto in_cells = [](std::size_t cells, std::size_t pieces, const planning::Polytope& piece) {
    planning::ObstacleUpdate update;
    update.cells.assign(cells, {0, std::vector<planning::Polytope>(pieces, piece)});
    return update;
  };
  EXPECT_TRUE(encode(0, in_cells(planning::kMaxUpdateCells, 0, point), packet));
  EXPECT_FALSE(encode(0, in_cells(planning::kMaxUpdateCells + 1, 0, point), packet));
  EXPECT_TRUE(encode(0, in_cells(64, planning::kMaxCellPieces, point), packet));
  EXPECT_FALSE(encode(0, in_cells(1, planning::kMaxCellPieces + 1, point), packet));
  EXPECT_FALSE(encode(0, in_cells(65, planning::kMaxCellPieces, point), packet)) << "too many";
  point.vertices.resize(planning::kMaxPieceVertices + 1);
  EXPECT_FALSE(encode(0, in_cells(1, 1, point), packet));
  point.vertices.clear();
  EXPECT_FALSE(encode(0, in_cells(1, 1, point), packet));

  MapCorrection correction;
  correction.nodes.resize(kMaxMapCorrectionNodes + 1);
  EXPECT_FALSE(encode(0, correction, packet));

  PlanQuery query;
  query.request.previous.resize(kMaxWaypoints + 1);
  EXPECT_FALSE(encode(0, query, packet));
  query.request.previous.clear();
  query.request.trail.resize(kMaxWaypoints + 1);
  EXPECT_FALSE(encode(0, query, packet));

  TruthRecord truth;
  truth.contacts.assign(link::kMaxContacts, "rock");
  EXPECT_TRUE(encode(truth, packet));
  truth.contacts.emplace_back("one more");
  EXPECT_FALSE(encode(truth, packet));

  EXPECT_FALSE(encode(0, FailsafeRecord{std::string("a\0b", 3), "", "", ""}, packet));
  LogHeader header = sample_header();
  header.map_xml.assign(kMaxFileText, ' ');
  EXPECT_FALSE(encode(header, packet));
  header.map_xml.clear();
  header.map_meshes.assign(kMaxMeshText, ' ');
  EXPECT_FALSE(encode(header, packet));
}

// Equal where the layout has a text or a list: only a value with every field at its limit shows
// that the bound is not too small.
TEST(Codec, TheLargestPacketOfEachKindIsWithinItsChannelsBound) {
  Packet packet;
  std::set<Channel> checked;
  const auto expect_bound = [&](Channel channel, const auto&... value) {
    EXPECT_TRUE(encode(value..., packet)) << to_string(channel);
    EXPECT_EQ(packet.size(), max_packet_size(channel)) << to_string(channel);
    checked.insert(channel);
  };
  const auto expect_within = [&](Channel channel, const auto&... value) {
    EXPECT_TRUE(encode(value..., packet)) << to_string(channel);
    EXPECT_LE(packet.size(), max_packet_size(channel)) << to_string(channel);
    checked.insert(channel);
  };
  const std::string text(kMaxText - 1, 'x');
  {
    const std::string file(kMaxFileText - 1, 'x');
    expect_bound(Channel::kHeader,
                 LogHeader{text, text, 0, text, file, text, file,
                           std::string(kMaxMeshText - 1, 'x'), file, file, 1.0, text});
  }
  packet = {};
  expect_within(Channel::kAhrs, ImuSample{});
  expect_within(Channel::kDepth, DepthSample{});
  expect_within(Channel::kHealth, HealthSample{});
  PlanReply reply;
  reply.plan.reason = text;
  reply.plan.reduced = {.obstacle = text};
  reply.plan.waypoints.resize(kMaxWaypoints);
  expect_bound(Channel::kPlan, Utime{0}, reply);
  expect_bound(Channel::kOperator, Utime{0}, OperatorCommand::kAbort);
  planning::Polytope piece;
  piece.vertices.resize(planning::kMaxPieceVertices);
  planning::ObstacleUpdate update;
  update.cells.resize(planning::kMaxUpdateCells);
  for (std::size_t i = 0; i < planning::kMaxUpdatePieces; ++i) {
    update.cells[i / planning::kMaxCellPieces].pieces.push_back(piece);
  }
  update.objects.resize(planning::kMaxUpdateObjects);
  expect_bound(Channel::kObstacles, Utime{0}, update);
  expect_bound(Channel::kFreeAhead, Utime{0}, planning::FreeAhead{});
  expect_bound(Channel::kObstacleAhead, Utime{0}, planning::ObstacleAhead{});
  expect_bound(Channel::kPoseCorrection, Utime{0}, planning::PoseCorrection{});
  MapCorrection correction;
  correction.nodes.resize(kMaxMapCorrectionNodes);
  expect_bound(Channel::kMapCorrection, Utime{0}, correction);
  expect_bound(Channel::kMapFix, Utime{0}, MapFix{});
  expect_bound(Channel::kVision, Utime{0}, estimation::VisionEstimate{});
  expect_bound(Channel::kLoss, Utime{0}, RecordingLoss{});
  expect_within(Channel::kCommand, Utime{0}, vehicle::Command{});
  expect_within(Channel::kRates, Utime{0}, vehicle::PseudoRates{});
  expect_bound(Channel::kEstimate, estimation::StateEstimate{});
  Status status;
  status.state = status.goal = status.rung = text;
  expect_bound(Channel::kStatus, Utime{0}, status);
  PlanQuery query;
  query.state = query.cause = text;
  query.request.previous.resize(kMaxWaypoints);
  query.request.trail.resize(kMaxWaypoints);
  expect_bound(Channel::kPlanQuery, Utime{0}, query);
  expect_bound(Channel::kTransition, Utime{0}, TransitionRecord{text, text, text, text, text});
  expect_bound(Channel::kFailsafe, Utime{0}, FailsafeRecord{text, text, text, text});
  ActionRecord action;
  action.text = text;
  expect_bound(Channel::kAction, Utime{0}, action);
  expect_bound(Channel::kTruth,
               TruthRecord{0, {}, std::vector(link::kMaxContacts, text), 0.0, text});
  expect_bound(Channel::kTick, TickMark{});  // every tick mark has this size
  EXPECT_EQ(checked.size(), kChannelNames.size()) << "a channel is not checked";
}

TEST(Digest, IsFnv1a64) {
  const auto digest = [](std::string_view text) {
    Fnv1a64 fnv;
    fnv.add(text);
    return fnv.value();
  };
  // Test vectors of the algorithm's authors.
  EXPECT_EQ(digest(""), 0xcbf29ce484222325ULL);
  EXPECT_EQ(digest("a"), 0xaf63dc4c8601ec8cULL);
  EXPECT_EQ(digest("foobar"), 0x85944171f73967e8ULL);
}

TEST(Digest, OfAHeaderDistinguishesFiles) {
  LogHeader header = sample_header();
  header.mission_xml = std::string(2, 'a');
  header.map_xml = std::string(1, 'a');
  const std::string before = log_digest(header);
  EXPECT_EQ(before.size(), 16U);
  header.mission_xml.swap(header.map_xml);
  EXPECT_NE(log_digest(header), before);
}

}  // namespace
}  // namespace dive::mission::testing
