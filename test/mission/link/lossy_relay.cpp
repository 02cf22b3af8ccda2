// Relays packets between a vehicle's group and an executive's in both directions: drops, delays and
// duplicates them.
//
//    lossy_relay VEHICLE_URL EXECUTIVE_URL LOSS SEED

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <lcm/lcm.h>
#include <poll.h>

namespace {

using Clock = std::chrono::steady_clock;

struct Waiting {
  lcm_t* to = nullptr;
  std::string channel;
  std::vector<char> data;
};

struct Side {
  lcm_t* from = nullptr;
  lcm_t* to = nullptr;
};

double loss = 0.0;
std::mt19937 generator;
std::multimap<Clock::time_point, Waiting> waiting;

double draw() { return std::uniform_real_distribution<>(0.0, 1.0)(generator); }

void relay(const lcm_recv_buf_t* buffer, const char* channel, void* user) {
  const auto* side = static_cast<const Side*>(user);
  const auto* data = static_cast<const char*>(buffer->data);
  const int copies = draw() < 0.1 ? 2 : 1;
  for (int i = 0; i < copies; ++i) {
    if (draw() < loss) continue;
    // A fifth of them are overtaken by later ones.
    const auto delay =
        std::chrono::microseconds(draw() < 0.2 ? static_cast<int>(30'000 * draw()) : 0);
    waiting.emplace(Clock::now() + delay,
                    Waiting{side->to, channel, {data, data + buffer->data_size}});
  }
}

void hand_on_what_is_due() {
  while (!waiting.empty() && waiting.begin()->first <= Clock::now()) {
    const Waiting& packet = waiting.begin()->second;
    lcm_publish(packet.to, packet.channel.c_str(), packet.data.data(),
                static_cast<unsigned>(packet.data.size()));
    waiting.erase(waiting.begin());
  }
}

void subscribe(Side& side, const char* channels) {
  lcm_subscription_set_queue_capacity(lcm_subscribe(side.from, channels, relay, &side), 1000);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  lcm_t* vehicle = lcm_create(argv[1]);
  lcm_t* executive = lcm_create(argv[2]);
  if (vehicle == nullptr || executive == nullptr) return 2;
  loss = std::atof(argv[3]);
  generator.seed(static_cast<unsigned>(std::atoi(argv[4])));
  Side forth{vehicle, executive};
  Side back{executive, vehicle};
  // The channels of the two directions are disjoint, so that no packet circulates.
  subscribe(forth, "DIVE_(AHRS|IMU|DEPTH|HEALTH|RANGE|IMAGE|SIM_TICK|SIM_TRUTH|OPERATOR)");
  subscribe(back, "DIVE_(COMMAND|HEARTBEAT|STATUS|ESTIMATE|PATH|OPERATOR_ANSWER)");
  for (;;) {
    pollfd readable[2] = {{lcm_get_fileno(vehicle), POLLIN, 0},
                          {lcm_get_fileno(executive), POLLIN, 0}};
    poll(readable, 2, 1);
    for (lcm_t* side : {vehicle, executive}) {
      while (lcm_handle_timeout(side, 0) > 0) {
      }
    }
    hand_on_what_is_due();
  }
}
