// A dive with a key under attack. `flood`: random and crafted datagrams as fast as one process can
// send them, against executive and supervisor: they must not end, grow or become late. `forge`:
// forged packets of each kind and recordings of real ones, a thousand times: none may be obeyed.

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "test/mission/link/attacker.h"
#include "test/mission/link/process.h"
#include "test/vehicle/link/datagrams.h"

namespace {

namespace fs = std::filesystem;
using dive::link::testing::Bytes;
using dive::mission::testing::Process;

/// Resident memory of a process, kB; 0 if it has ended.
long resident_kb(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string word; status >> word;) {
    long kb = 0;
    if (word == "VmRSS:" && status >> kb) return kb;
  }
  return 0;
}

/// Copies the mission, so that an abort needs the key, and returns the copy.
std::string with_key_for_abort(const fs::path& mission, const fs::path& folder) {
  std::ifstream stream(mission, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  text.insert(text.find("<failsafes>"), "<operator abort=\"key\"/>");
  const fs::path copy = folder / mission.filename();
  std::ofstream(copy, std::ios::binary) << text;
  fs::copy(mission.parent_path() / "maps", folder / "maps", fs::copy_options::recursive);
  return copy.string();
}

class Dive {
 public:
  Dive(const std::string& original, const std::string& url) : url_(url) {
    folder_ = (fs::temp_directory_path() / "dive-attack").string();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const std::string mission = with_key_for_abort(original, folder_);
    Process({DIVE_COMMAND, "key", folder_ + "/key"}, folder_, "key").wait(10.0);
    vehicle = start("sim", {"sim", mission});
    supervisor = start("supervise", {"supervise"});
    executive = start("run", {"run", mission, "--stats", "--log", folder_ + "/log"});
  }

  std::unique_ptr<Process> vehicle;
  std::unique_ptr<Process> supervisor;
  std::unique_ptr<Process> executive;

 private:
  std::unique_ptr<Process> start(const std::string& name, std::vector<std::string> words) const {
    words.insert(words.begin(), DIVE_COMMAND);
    words.insert(words.end(), {"--lcm", url_, "--key", folder_ + "/key", "--json"});
    return std::make_unique<Process>(words, folder_, name);
  }

  std::string url_;
  std::string folder_;
};

/// Datagrams that are noise, and some that are nearly packets.
class Flood {
 public:
  Flood(const std::string& url, std::int64_t noise, std::int64_t crafted)
      : sender_(*dive::link::parse_udpm_url(url)), noise_(noise), crafted_(crafted) {
    namespace testing = dive::link::testing;
    namespace channel = dive::link::channel;
    for (const char* name : {channel::kCommand, channel::kDepth, channel::kRequest,
                             channel::kPresence, channel::kHeartbeat}) {
      real_.push_back(testing::short_datagram(name, Bytes(130, 3)));
      real_.push_back(testing::overflowing_datagram(name));
      for (Bytes& part : testing::fragments(name, Bytes(200, 7), 60)) {
        real_.push_back(std::move(part));
      }
    }
  }

  [[nodiscard]] bool is_over() const { return sent_ >= noise_ + crafted_; }
  [[nodiscard]] std::int64_t sent() const { return sent_; }

  void send(int count) {
    for (int i = 0; i < count && !is_over(); ++i, ++sent_) {
      const bool is_crafted = sent_ % (noise_ / crafted_ + 1) == 0;
      const Bytes bytes = is_crafted ? crafted() : noise();
      sender_.send(bytes);
    }
  }

 private:
  [[nodiscard]] Bytes noise() {
    Bytes bytes(random_() % 200);
    for (std::size_t i = 0; i < bytes.size(); i += 8) {
      const std::uint64_t word = random_();
      std::memcpy(&bytes[i], &word, std::min<std::size_t>(8, bytes.size() - i));
    }
    return bytes;
  }
  [[nodiscard]] Bytes crafted() {
    Bytes bytes = real_[random_() % real_.size()];
    for (std::uint64_t changes = random_() % 4; changes > 0; --changes) {
      constexpr std::size_t kHeader = 36;
      bytes[random_() % kHeader] = static_cast<std::uint8_t>(random_());
    }
    return bytes;
  }

  dive::link::testing::DatagramSender sender_;
  std::int64_t noise_;
  std::int64_t crafted_;
  std::int64_t sent_ = 0;
  std::vector<Bytes> real_;
  std::mt19937_64 random_{1};
};

struct Memory {
  long first = 0;
  long largest = 0;

  void observe(const Process& process) {
    const long kb = resident_kb(process.pid());
    if (first == 0) first = kb;
    largest = std::max(largest, kb);
  }
};

int report(Dive& dive, const std::string& attack) {
  const int executive = dive.executive->wait(600.0);
  const int vehicle = dive.vehicle->wait(60.0);
  const int supervisor = dive.supervisor->wait(60.0);
  fmt::print("{}: exit status of executive {}, vehicle {}, supervisor {}\n", attack, executive,
             vehicle, supervisor);
  if (executive < 0 || executive > 2 || vehicle != 0) return 1;
  const auto stats = dive.executive->json().at("stats");
  fmt::print("executive {}: control late by {} ms (99.9th percentile), {} ms at most; {}\n",
             dive.executive->json().at("outcome").get<std::string>(),
             stats.at("lateness_ms").at("p999").dump(), stats.at("lateness_ms").at("max").dump(),
             stats.at("rejected").dump());
  return executive == 0 && supervisor == 0 ? 0 : 1;
}

int flood(Dive& dive, const std::string& url, std::int64_t noise, std::int64_t crafted) {
  std::this_thread::sleep_for(std::chrono::seconds(3));
  Flood datagrams(url, noise, crafted);
  Memory executive;
  Memory supervisor;
  const auto begin = std::chrono::steady_clock::now();
  while (!datagrams.is_over() && dive.executive->wait(0.001) < 0) {
    executive.observe(*dive.executive);
    supervisor.observe(*dive.supervisor);
    datagrams.send(10'000);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  fmt::print(
      "{} datagrams in {:.1f} s; memory of the executive from {} to at most {} kB, of the "
      "supervisor "
      "from {} to {} kB\n",
      datagrams.sent(), took.count(), executive.first, executive.largest, supervisor.first,
      supervisor.largest);
  return report(dive, "flood");
}

int forge(Dive& dive, const std::string& url, int count) {
  std::this_thread::sleep_for(std::chrono::seconds(3));
  dive::mission::testing::Attacker attacker(url);
  int attacks = 0;
  for (; attacks < count && dive.executive->wait(0.01) < 0; ++attacks) attacker.attack();
  fmt::print("{} forged packets of each kind, 20 recorded ones of each channel with each\n",
             attacks);
  return report(dive, "forge");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Attacks a dive with a key.");
  std::string attack;
  std::string mission = DIVE_SOURCE_DIR "/missions/pool3.xml";
  std::int64_t noise = 10'000'000;
  std::int64_t crafted = 100'000;
  int count = 1000;
  app.add_option("ATTACK", attack, "flood or forge")
      ->required()
      ->check(CLI::IsMember({"flood", "forge"}));
  app.add_option("--mission", mission, "Mission with <failsafes>");
  app.add_option("--random", noise, "Random datagrams of the flood");
  app.add_option("--crafted", crafted, "Crafted datagrams of the flood");
  app.add_option("--count", count, "Forged packets of each kind");
  CLI11_PARSE(app, argc, argv);
  const std::string url = fmt::format("udpm://239.255.76.67:{}?ttl=0", 52'000 + ::getpid() % 5000);
  Dive dive(mission, url);
  return attack == "flood" ? flood(dive, url, noise, crafted) : forge(dive, url, count);
}
