// Kills thousands of dives and checks that each one is found again at its last checkpoint.

#include <algorithm>
#include <chrono>
#include <filesystem>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "common/random.h"
#include "test/mission/record/killed_dive.h"

namespace {

using dive::mission::read_journal;
using dive::mission::testing::first_bank_of;
using dive::mission::testing::KilledDive;

std::int64_t commits_in(const std::string& text) {
  std::int64_t commits = 0;
  for (std::size_t at = 0; (at = text.find("\"active\":", at)) != std::string::npos; ++at)
    ++commits;
  return commits;
}

// True if the rest of the file is a prefix of the whole, and its last checkpoint is found.
bool is_found(const std::string& path, const std::string& whole) {
  const std::string kept = first_bank_of(path);
  if (!whole.starts_with(kept)) return false;
  const std::string lines = kept.substr(0, kept.rfind('\n') + 1);
  const auto journal = read_journal(path);
  if (lines.empty()) return !journal;
  return journal && journal->commits == commits_in(lines);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Kills dives at random instants and after every line of their journal.");
  int kills = 1000;
  std::uint64_t seed = 1;
  app.add_option("--kills", kills, "At random instants");
  app.add_option("--seed", seed, "Of the instants");
  CLI11_PARSE(app, argc, argv);

  std::string pattern = (std::filesystem::temp_directory_path() / "dive-kill-XXXXXX").string();
  const std::filesystem::path folder = mkdtemp(pattern.data());
  const std::string path = (folder / "killed.journal").string();
  const KilledDive dive;
  const auto begin = std::chrono::steady_clock::now();
  dive.dive((folder / "whole.journal").string());
  const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
  const std::string whole = first_bank_of((folder / "whole.journal").string());
  const auto lines = std::ranges::count(whole, '\n');

  int lost = 0;
  for (std::int64_t line = 1; line <= lines; ++line) {
    dive.kill_after_line(path, line);
    lost += is_found(path, whole) ? 0 : 1;
  }
  fmt::print("after every one of {} lines: {} not found\n", lines, lost);

  dive::Random random(seed);
  int killed = 0;
  int torn = 0;
  for (int i = 0; i < kills; ++i) {
    std::filesystem::remove(path);
    const auto after = static_cast<std::int64_t>(random.uniform(0.0, 1.2 * took.count()));
    killed += dive.kill_after(path, after) ? 1 : 0;
    const std::string kept = first_bank_of(path);
    torn += !kept.empty() && kept.back() != '\n' ? 1 : 0;
    lost += is_found(path, whole) ? 0 : 1;
  }
  fmt::print("at {} random instants ({} under way, {} in the middle of a line): {} not found\n",
             kills, killed, torn, lost);
  std::filesystem::remove_all(folder);
  return lost == 0 ? 0 : 1;
}
