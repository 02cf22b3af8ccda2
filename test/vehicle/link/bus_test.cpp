// The link over UDP multicast on this machine. Skipped if the machine does not route multicast.

#include "vehicle/link/bus.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <unistd.h>

#include "test/vehicle/link/datagrams.h"
#include "vehicle/link/udpm_url.h"

namespace dive::link {
namespace {

using testing::Bytes;

class OverMulticast : public ::testing::Test {
 protected:
  void SetUp() override {
    url_ = fmt::format("udpm://239.255.76.67:{}?ttl=0", 36'000 + ::getpid() % 15'000);
    auto bus = Bus::open(url_);
    if (!bus) GTEST_SKIP() << "no multicast on this machine";
    bool received = false;
    bus->subscribe("DIVE_TEST", 16, [&](PacketView) { return received = true; });
    bus->publish("DIVE_TEST", Packet(8));
    if (!until(*bus, [&] { return received; })) GTEST_SKIP() << "no multicast on this machine";
  }

  static bool until(Bus& bus, const std::function<bool()>& enough) {
    return bus.wait(clock(), clock().now() + 60 * kMicrosecondsPerSecond, enough);
  }
  static Clock& clock() {
    static SteadyClock steady;
    return steady;
  }

  std::string url_;
};

// LCM 1.3.1's own receiver ends in a segmentation fault at this packet.
TEST_F(OverMulticast, NoPacketEndsTheReceiver) {
  Bus receiver = *Bus::open(url_);
  std::size_t received = 0;
  receiver.subscribe("DIVE_IMU", 100'000, [&](PacketView packet) {
    received = packet.size();
    return true;
  });
  const testing::DatagramSender sender(*parse_udpm_url(url_));
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(sender.send(testing::overflowing_datagram("DIVE_IMU")));
    ASSERT_TRUE(sender.send(Bytes(static_cast<std::size_t>(i), 0x4c)));
  }
  Bus vehicle = *Bus::open(url_);
  for (int i = 0; i < 100 && received == 0; ++i) {  // a packet may be lost
    ASSERT_TRUE(vehicle.publish("DIVE_IMU", Packet(90'000)));
    receiver.wait(clock(), clock().now() + kMicrosecondsPerSecond, [&] { return received > 0; });
  }
  EXPECT_EQ(received, 90'000U);
}

void keep_size(const lcm_recv_buf_t* buffer, const char* /*channel*/, void* user) {
  *static_cast<std::optional<std::size_t>*>(user) = buffer->data_size;
}

TEST_F(OverMulticast, IsUnderstoodByLcmAndUnderstandsIt) {
  const std::unique_ptr<lcm_t, decltype(&lcm_destroy)> other(
      lcm_create((url_ + "&recv_buf_size=4000000").c_str()), &lcm_destroy);
  std::optional<std::size_t> theirs;
  lcm_subscribe(other.get(), "DIVE_RANGE", keep_size, &theirs);
  Packet packet(300'000);
  for (std::size_t i = 0; i < packet.size(); ++i) packet[i] = static_cast<std::uint8_t>(i * i);
  for (const bool has_key : {false, true}) {
    Bus bus = *Bus::open(url_, {.key = has_key ? std::optional(new_key()) : std::nullopt});
    std::optional<Packet> ours;
    const auto keep = [&](PacketView view) {
      ours.emplace(view.begin(), view.end());
      return true;
    };
    bus.subscribe("DIVE_TEST", packet.size(), keep, Access::kAnyone);
    // 65,499 bytes of channel and packet are the most that LCM puts into one datagram.
    for (const std::ptrdiff_t size : {0, 10, 65'488, 65'489, 65'490, 131'000, 300'000}) {
      const Packet sent(packet.begin(), packet.begin() + size);
      const std::size_t expected = sent.size() + (has_key ? kTrailerSize : 0);
      for (int i = 0; i < 100 && theirs != expected; ++i) {  // a packet may be lost
        bus.publish("DIVE_RANGE", sent);
        lcm_handle_timeout(other.get(), 1000);
      }
      EXPECT_EQ(theirs, expected);
      for (int i = 0; i < 100 && ours != sent; ++i) {
        lcm_publish(other.get(), "DIVE_TEST", sent.data(), static_cast<unsigned>(sent.size()));
        bus.wait(clock(), clock().now() + kMicrosecondsPerSecond, [&] { return ours == sent; });
      }
      EXPECT_TRUE(ours == sent) << size;
    }
  }
}

TEST_F(OverMulticast, WithAKeyProcessesFindEachOtherAndExcludeOthers) {
  const Key key = new_key();
  Bus vehicle = *Bus::open(url_, {.key = key, .role = Role::kVehicle});
  Bus executive = *Bus::open(url_, {.key = key, .role = Role::kExecutive});
  Bus stranger = *Bus::open(url_, {.key = new_key(), .role = Role::kVehicle});
  Bus anonymous = *Bus::open(url_);
  std::vector<double> depths;
  executive.listen<DepthSample>(channel::kDepth, [&](const DepthSample& sample) {
    depths.push_back(sample.depth_m);
    EXPECT_EQ(executive.sender().role, Role::kVehicle);
    EXPECT_EQ(executive.sender().trust, Trust::kAuthentic);
  });
  const auto send = [](Bus& bus, double depth) {
    Packet packet;
    ASSERT_TRUE(encode(DepthSample{.utime = 1, .depth_m = depth}, packet));
    bus.publish(channel::kDepth, packet);
  };
  for (int i = 0; i < 1000 && depths.size() < 3; ++i) {
    send(stranger, 1e6);
    send(anonymous, 1e6);
    send(vehicle, 2.0);
    executive.wait(clock(), clock().now() + 20'000);
  }
  ASSERT_GE(depths.size(), 3U);
  for (const double depth : depths) EXPECT_EQ(depth, 2.0);
  EXPECT_GT(executive.rejections().unauthenticated, 0);
}

TEST(UdpmUrl, IsReadOrRefusedWithAReason) {
  const auto url = parse_udpm_url("udpm://239.1.2.3:7000?ttl=3&recv_buf_size=2000");
  ASSERT_TRUE(url);
  EXPECT_EQ(url->address, "239.1.2.3");
  EXPECT_EQ(url->port, 7000);
  EXPECT_EQ(url->ttl, 3);
  EXPECT_EQ(url->receive_bytes, 2000);
  EXPECT_EQ(to_lcm(*url), "udpm://239.1.2.3:7000?ttl=3");
  const auto defaults = parse_udpm_url("udpm://");
  ASSERT_TRUE(defaults);
  EXPECT_EQ(to_lcm(*defaults), "udpm://239.255.76.67:7667?ttl=0");
  for (const auto& [text, reason] :
       {std::pair("file:///tmp/log", "must be an LCM URL"),
        std::pair("udpm://10.0.0.1:7000", "multicast address"),
        std::pair("udpm://239.1.2.3:0", "no port"), std::pair("udpm://239.1.2.3:70000", "no port"),
        std::pair("udpm://239.1.2.3?ttl=-1", "no value of ttl"),
        std::pair("udpm://239.1.2.3?tll=1", "the options are")}) {
    const auto refused = parse_udpm_url(text);
    ASSERT_FALSE(refused) << text;
    EXPECT_NE(refused.error().find(reason), std::string::npos) << refused.error();
  }
}

}  // namespace
}  // namespace dive::link
