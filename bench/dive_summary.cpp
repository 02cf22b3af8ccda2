#include "bench/dive_summary.h"

#include <algorithm>
#include <iostream>
#include <map>
#include <ranges>
#include <utility>

#include <fmt/format.h>

namespace dive::bench {
namespace {

// The distribution of one kind of clearance, and the five dives with the least.
void report_clearance(const std::string& what, const char* key,
                      const std::vector<nlohmann::json>& results) {
  std::vector<std::pair<double, int>> clearances;
  for (const nlohmann::json& r : results) {
    if (r[key].is_number()) clearances.emplace_back(r[key], r["seed"]);
  }
  if (clearances.empty()) return;
  std::ranges::sort(clearances);
  const auto at = [&](double share) {
    const double last = static_cast<double>(clearances.size()) - 1.0;
    return clearances[static_cast<std::size_t>(share * last)].first;
  };
  std::cout << fmt::format(
      "  {} (ground truth) min {:.3f}, p05 {:.3f}, p25 {:.3f}, median {:.3f}, max {:.3f} m; least:",
      what, at(0.0), at(0.05), at(0.25), at(0.5), at(1.0));
  for (const auto& [least_m, seed] : clearances | std::views::take(5)) {
    std::cout << fmt::format(" seed {} ({:.3f} m)", seed, least_m);
  }
  std::cout << '\n';
}

// Why the nearest passes of the dives with the least clearance were nearer than planned.
void report_passes(std::vector<nlohmann::json> results) {
  std::erase_if(results, [](const nlohmann::json& r) { return !r["as_stands"].is_number(); });
  std::ranges::sort(results, {},
                    [](const nlohmann::json& r) { return r["as_stands"].get<double>(); });
  for (const nlohmann::json& r : results | std::views::take(5)) {
    std::cout << fmt::format(
        "  seed {} at {:.1f} s: path {:.2f} m and {:.2f} m off it; at the estimate {:.2f}, at the "
        "true position {:.2f}, with the obstacles where they stand {:.2f} m\n",
        r["seed"].get<int>(), r["at"].get<double>(), r["planned"].get<double>(),
        r["off_path_there"].get<double>(), r["as_estimated"].get<double>(),
        r["as_drawn"].get<double>(), r["as_stands"].get<double>());
  }
}

// The errors of position over all dives, and how well the covariance describes them.
void report_errors(const std::vector<nlohmann::json>& results) {
  constexpr double kBound = 9.21;  // 99 % of the chi-square distribution of two degrees of freedom
  const auto dives = static_cast<double>(results.size());
  double nees = 0.0;
  double nees_in_map = 0.0;
  int beyond = 0;
  std::vector<double> p95;
  std::vector<double> last;
  for (const nlohmann::json& r : results) {
    nees += r["nees"].get<double>() / dives;
    nees_in_map += r["nees_in_map"].get<double>() / dives;
    beyond += r["nees"].get<double>() > kBound ? 1 : 0;
    p95.push_back(r["error_p95"]);
    last.push_back(r["error_end"]);
  }
  if (p95.empty()) return;
  std::ranges::sort(p95);
  std::ranges::sort(last);
  std::cout << fmt::format(
      "  position relative to the map: p95 of a dive's errors median {:.3f}, max {:.3f} m; at the "
      "end median {:.3f}, p95 {:.3f}, max {:.3f} m, NEES {:.2f}; in the world NEES {:.2f}, {} of "
      "{} "
      "beyond {}\n",
      p95[p95.size() / 2], p95.back(), last[last.size() / 2], last[last.size() * 95 / 100],
      last.back(), nees_in_map, nees, beyond, last.size(), kBound);
}

// The largest distance of each dive from the path being followed, as estimated.
void report_off_path(const std::vector<nlohmann::json>& results) {
  std::vector<double> distances;
  for (const nlohmann::json& r : results) distances.push_back(r["off_path"]);
  if (distances.empty()) return;
  std::ranges::sort(distances);
  std::cout << fmt::format("  largest distance from the path median {:.2f}, max {:.2f} m\n",
                           distances[distances.size() / 2], distances.back());
}

// The least margin of the position in each dive, as the vehicle computes it.
void report_margins(const std::vector<nlohmann::json>& results) {
  std::vector<std::pair<double, int>> margins;
  for (const nlohmann::json& r : results) margins.emplace_back(r["margin"], r["seed"]);
  if (margins.empty()) return;
  std::ranges::sort(margins);
  std::cout << fmt::format(
      "  least margin of a dive min {:.1f} (seed {}), p05 {:.1f}, median {:.1f} sigmas\n",
      margins.front().first, margins.front().second, margins[margins.size() / 20].first,
      margins[margins.size() / 2].first);
}

// The dives in which the failsafe for a wrong map was raised, and when.
void report_wrong_map(const std::vector<nlohmann::json>& results) {
  std::vector<double> times;
  std::string seeds;
  for (const nlohmann::json& r : results) {
    if (r["wrong_map"].get<double>() < 0.0) continue;
    times.push_back(r["wrong_map"]);
    seeds += fmt::format(" {}", r["seed"].get<int>());
  }
  if (times.empty()) return;
  std::ranges::sort(times);
  std::cout << fmt::format(
      "  wrong_map in {} dives, after {:.1f} to {:.1f} s, median {:.1f} s; seeds{}\n", times.size(),
      times.front(), times.back(), times[times.size() / 2], seeds);
}

}  // namespace

void print_summary(const std::string& name, std::vector<nlohmann::json> results) {
  std::ranges::sort(results, {}, [](const nlohmann::json& r) { return r["seed"].get<int>(); });
  std::map<std::string, int> outcomes;
  int collided = 0;
  int reached = 0;
  int hidden = 0;
  for (const nlohmann::json& r : results) {
    ++outcomes[r["outcome"].get<std::string>()];
    if (r["collisions"].get<int>() > 0) ++collided;
    if (r["hidden"].get<int>() > 0) ++hidden;
    if (r["reached"].get<bool>()) ++reached;
    if (!r["reached"].get<bool>()) {
      std::cout << fmt::format("  seed {}: {} in {} after {:.0f} s, {:.1f} m deep: {}\n",
                               r["seed"].get<int>(), r["outcome"].get<std::string>(),
                               r["state"].get<std::string>(), r["duration"].get<double>(),
                               r["depth"].get<double>(), r["cause"].get<std::string>());
    }
  }
  std::cout << name << ": " << results.size() << " dives";
  for (const auto& [outcome, count] : outcomes) std::cout << ", " << count << ' ' << outcome;
  std::cout << fmt::format("; {} reached all goals; {} with a collision", reached, collided);
  if (hidden > 0) {
    std::cout << fmt::format(
        ", {} of them with an object in the range camera's view for less than a second", hidden);
  }
  std::cout << '\n';
  report_clearance("clearance to what stands still", "clearance", results);
  report_passes(results);
  report_clearance("clearance to the diver", "from_diver", results);
  report_errors(results);
  report_off_path(results);
  report_margins(results);
  report_wrong_map(results);
}

}  // namespace dive::bench
