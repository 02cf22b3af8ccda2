#include "mission/cli/estimate_comparison.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/source_text.h"
#include "mission/cli/terminal.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;
using estimation::Trajectory;

constexpr std::size_t kMaxBytes = std::size_t{256} << 20U;
constexpr std::size_t kMinPoses = 3;  // to align

Trajectory between(const Trajectory& trajectory, Utime begin, Utime end) {
  Trajectory part;
  std::copy_if(
      trajectory.begin(), trajectory.end(), std::back_inserter(part),
      [&](const estimation::StampedPose& at) { return at.utime >= begin && at.utime <= end; });
  return part;
}

std::string seconds(Utime begin, Utime end) {
  return fmt::format("from {:.3f} s to {:.3f} s", to_seconds(begin), to_seconds(end));
}

void print_row(const char* name, const char* unit, const std::optional<double>& ours,
               const std::optional<double>& theirs) {
  const auto text = [&](const std::optional<double>& value) {
    return value ? fmt::format("{:.3f} {}", *value, unit) : std::string("-");
  };
  print(fmt::format("  {:<22} {:>12} {:>12}", name, text(ours), text(theirs)));
}

void print_relative(const Comparison& comparison) {
  for (const estimation::RelativeError& ours : comparison.ours.relative) {
    const auto& others = comparison.theirs.relative;
    const auto same = std::find_if(others.begin(), others.end(), [&](const auto& error) {
      return error.distance_m == ours.distance_m;
    });
    print_row(fmt::format("RPE in {:g} m", ours.distance_m).c_str(), "m", ours.mean_m,
              same == others.end() ? std::nullopt : std::optional(same->mean_m));
  }
}

}  // namespace

tl::expected<Trajectory, std::string> read_other(const std::string& path,
                                                 const estimation::Recording& recording) {
  const auto fail = [&](const std::string& what) {
    return tl::make_unexpected(fmt::format("{}: {}", path, what));
  };
  const auto text = read_source_text(path, kMaxBytes);
  if (!text) return fail(text.error());
  auto trajectory = estimation::from_tum(text->content(), path);
  if (!trajectory) return trajectory;
  if (trajectory->size() < kMinPoses) {
    return fail(fmt::format("{} poses; at least {} are needed to align them", trajectory->size(),
                            kMinPoses));
  }
  if (recording.truth.empty()) {
    return fail("there is nothing to compare it with: the recording has no ground truth");
  }
  const auto& images = recording.cameras.at(0).images;
  const Utime begin = std::max(images.front().utime, recording.truth.front().utime);
  const Utime end = std::min(images.back().utime, recording.truth.back().utime);
  if (between(*trajectory, begin, end).size() >= kMinPoses) return trajectory;
  return fail(
      fmt::format("its poses are {}, the recording's images with ground truth {}: fewer "
                  "than {} poses are at the same time",
                  seconds(trajectory->front().utime, trajectory->back().utime), seconds(begin, end),
                  kMinPoses));
}

Comparison compare(const estimation::Recording& recording, const Trajectory& ours,
                   const Trajectory& theirs) {
  Comparison result;
  if (ours.empty() || theirs.empty()) return result;
  result.begin = std::max(ours.front().utime, theirs.front().utime);
  result.end = std::min(ours.back().utime, theirs.back().utime);
  result.ours = accuracy_of(recording, between(ours, result.begin, result.end));
  result.theirs = accuracy_of(recording, between(theirs, result.begin, result.end));
  return result;
}

Json to_json(const Comparison& comparison, const std::string& path) {
  const auto one = [](const Accuracy& accuracy) {
    Json json = {{"poses", accuracy.poses}, {"distance_m", accuracy.distance_m}};
    json.update(to_json(accuracy));
    json["attitude_deg"] =
        accuracy.yaw_aligned ? Json(accuracy.yaw_aligned->rmse_deg) : Json(nullptr);
    return json;
  };
  return {{"file", path},
          {"begin_s", to_seconds(comparison.begin)},
          {"end_s", to_seconds(comparison.end)},
          {"ours", one(comparison.ours)},
          {"theirs", one(comparison.theirs)}};
}

void print_comparison(const Comparison& comparison, const std::string& path) {
  const Accuracy& ours = comparison.ours;
  const Accuracy& theirs = comparison.theirs;
  if (ours.poses == 0 || theirs.poses == 0) {
    print(fmt::format(
        "against {}: at no time are there our estimate, its pose and the ground truth", path));
    return;
  }
  print(fmt::format("against {}, over the {:.1f} s that both cover:", path,
                    to_seconds(comparison.end - comparison.begin)));
  print(fmt::format("  {:<22} {:>12} {:>12}", "", "ours", "theirs"));
  print(fmt::format("  {:<22} {:>12} {:>12}", "poses", ours.poses, theirs.poses));
  using Error = std::optional<estimation::AbsoluteError>;
  const auto row = [&](const char* name, const char* unit, auto value, Error Accuracy::*which) {
    const auto of = [&](const Error& error) {
      return error ? std::optional((*error).*value) : std::nullopt;
    };
    print_row(name, unit, of(ours.*which), of(theirs.*which));
  };
  row("ATE", "m", &estimation::AbsoluteError::rmse_m, &Accuracy::yaw_aligned);
  row("largest error", "m", &estimation::AbsoluteError::max_m, &Accuracy::yaw_aligned);
  row("attitude", "deg", &estimation::AbsoluteError::rmse_deg, &Accuracy::yaw_aligned);
  row("ATE, rigidly aligned", "m", &estimation::AbsoluteError::rmse_m, &Accuracy::rigidly_aligned);
  print_relative(comparison);
  print_row("drift", "%", ours.drift_percent, theirs.drift_percent);
}

}  // namespace dive::mission
