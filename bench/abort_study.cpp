// Latency of an abort, from topside's request to the arrival of the resulting command at the
// vehicle. Every sample is a dive of its own: `dive sim`, `dive run --lcm` and an abort at a random
// instant, over UDP multicast, in real time, on a loaded machine.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/quantile.h"
#include "common/random.h"
#include "mission/link/topside.h"
#include "test/mission/link/process.h"
#include "vehicle/link/bus.h"

namespace {

using dive::Utime;
using dive::bench::quantile;
using dive::mission::testing::Process;
namespace link = dive::link;

constexpr Utime kPatience = 60 * dive::kMicrosecondsPerSecond;

/// The receiving side of the vehicle: a thread of its own, with the machine's monotonic clock.
class VehicleSide {
 public:
  explicit VehicleSide(const std::string& url) : bus_(*link::Bus::open(url)) {
    bus_.listen<link::OperatorAnswer>(
        link::channel::kAnswer, [this](const link::OperatorAnswer& answer) {
          is_accepted_ |= answer.command == dive::OperatorCommand::kAbort &&
                          answer.result == link::RequestResult::kAccepted;
        });
    bus_.listen<link::VehicleCommand>(link::channel::kCommand,
                                      [this](const link::VehicleCommand& command) {
                                        if (command.source != link::Source::kExecutive) return;
                                        is_commanded_ = true;
                                        // The executive replies in the tick that executes the
                                        // abort.
                                        if (is_accepted_ && !obeyed_) obeyed_ = clock_.now();
                                      });
  }

  [[nodiscard]] bool wait_for_commands() {
    return bus_.wait(clock_, clock_.now() + kPatience, [this] { return is_commanded_; });
  }
  /// Arrival time of the command that executes the abort.
  [[nodiscard]] std::optional<Utime> wait_for_obedience() {
    bus_.wait(clock_, clock_.now() + kPatience, [this] { return obeyed_.has_value(); });
    return obeyed_;
  }

 private:
  dive::SteadyClock clock_;
  link::Bus bus_;
  bool is_commanded_ = false;
  bool is_accepted_ = false;
  std::optional<Utime> obeyed_;
};

struct Settings {
  bool calls_program = false;
  std::string folder;
};

/// Latency in ms; absent if a message did not arrive.
std::optional<double> sample(const Settings& settings, int index, double after_s) {
  const std::string url = fmt::format("udpm://239.255.76.67:{}?ttl=0", 30'000 + index % 20'000);
  const std::string mission = DIVE_SOURCE_DIR "/missions/pool3.xml";
  const auto start = [&](const std::string& name, std::vector<std::string> words) {
    words.insert(words.begin(), DIVE_COMMAND);
    words.insert(words.end(), {"--lcm", url, "--json"});
    return std::make_unique<Process>(words, settings.folder, name);
  };
  VehicleSide vehicle_side(url);
  const auto vehicle = start("sim", {"sim", mission});
  const auto executive = start("run", {"run", mission, "--log", settings.folder + "/abort.lcmlog"});
  if (!vehicle_side.wait_for_commands()) return std::nullopt;
  std::this_thread::sleep_for(std::chrono::duration<double>(after_s));

  std::optional<Utime> obeyed;
  std::jthread listener([&] { obeyed = vehicle_side.wait_for_obedience(); });
  dive::SteadyClock clock;
  const Utime called = clock.now();
  if (settings.calls_program) {
    static_cast<void>(start("abort", {"abort"})->wait(60.0));
  } else if (auto bus = link::Bus::open(url)) {
    static_cast<void>(dive::mission::ask(dive::OperatorCommand::kAbort, *bus, url, clock,
                                         dive::to_seconds(kPatience)));
  }
  listener.join();
  if (!obeyed) return std::nullopt;
  return 1e3 * dive::to_seconds(*obeyed - called);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Aborts dives over the link at random instants, and measures how long that takes.");
  int samples = 1000;
  unsigned load = std::max(1U, std::thread::hardware_concurrency() / 2);
  std::uint64_t seed = 1;
  Settings settings;
  app.add_option("--samples", samples, "Dives");
  app.add_option("--load", load, "Threads that do nothing but compute; default: half the cores");
  app.add_option("--seed", seed, "Of the instants");
  app.add_flag("--program", settings.calls_program,
               "Start `dive abort` for every sample; its start is part of the time");
  CLI11_PARSE(app, argc, argv);

  settings.folder = (std::filesystem::temp_directory_path() / "dive-abort-study").string();
  std::atomic<bool> is_loaded = true;
  std::vector<std::jthread> loads;
  for (unsigned i = 0; i < load; ++i) {
    loads.emplace_back([&] {
      while (is_loaded) {
      }
    });
  }
  dive::Random random(seed);
  std::vector<double> ms;
  for (int i = 0; i < samples; ++i) {
    if (const auto one = sample(settings, i, random.uniform(0.0, 0.5))) ms.push_back(*one);
  }
  is_loaded = false;
  loads.clear();
  fmt::print("{} aborts, {} without an obeying command; {} thread(s) of load, {} cores\n", samples,
             samples - static_cast<int>(ms.size()), load, std::thread::hardware_concurrency());
  fmt::print(
      "from topside's {} to the vehicle's command, ms: median {:.1f}, 99th percentile "
      "{:.1f}, largest {:.1f}\n",
      settings.calls_program ? "program start" : "call", quantile(ms, 0.5), quantile(ms, 0.99),
      quantile(ms, 1.0));
  return static_cast<int>(ms.size()) == samples && quantile(ms, 0.99) <= 100.0 ? 0 : 1;
}
