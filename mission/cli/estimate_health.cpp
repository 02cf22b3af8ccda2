#include "mission/cli/estimate_health.h"

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "estimation/dataset/recording_check.h"
#include "mission/cli/terminal.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;
using estimation::DatasetRun;
using estimation::ImageFaults;
using estimation::ImuSummary;
using estimation::Recording;
using estimation::RunHealth;
using estimation::RunOptions;

bool is_visual(const RunOptions& options) {
  return options.estimator == estimation::EstimatorKind::kVisualInertial;
}

// "2 frozen, 12 dark"; empty if there are none.
std::string list_of(const std::vector<std::pair<long, const char*>>& counts) {
  std::vector<std::string> present;
  for (const auto& [count, what] : counts) {
    if (count > 0) present.push_back(fmt::format("{} {}", count, what));
  }
  return fmt::format("{}", fmt::join(present, ", "));
}

std::string or_none(const std::string& text) { return text.empty() ? "none" : text; }

void print_imu(const Recording& recording) {
  const ImuSummary imu = estimation::summary_of(recording);
  const std::string gaps =
      imu.gaps == 0 ? "no gaps"
                    : fmt::format("gaps {}, the longest of {:.3f} s", imu.gaps, imu.longest_gap_s);
  const std::string rest = list_of({{static_cast<long>(imu.saturated), "saturated"},
                                    {static_cast<long>(recording.imu_origin.refused), "refused"}});
  print(fmt::format("  IMU      {} samples, {}{}{}", recording.imu.size(), gaps,
                    rest.empty() ? "" : ", ", rest));
}

void print_samples(const char* what, std::size_t samples, std::size_t refused,
                   std::int64_t rejected) {
  if (samples + refused == 0) return;
  const std::string rest =
      list_of({{static_cast<long>(refused), "refused"}, {rejected, "rejected by the filter"}});
  print(fmt::format("  {:<9}{} samples{}{}", what, samples, rest.empty() ? "" : ", ", rest));
}

void print_images(const RunHealth& health) {
  const ImageFaults& images = health.images;
  const std::string faults = list_of({{images.bad, "unusable"},
                                      {images.frozen, "frozen"},
                                      {images.dark, "without contrast"},
                                      {images.blurred, "blurred"},
                                      {images.few_features, "with few features"},
                                      {images.lost, "with tracking lost"},
                                      {images.right_unused, "right images not used"}});
  print(fmt::format("  images   faults: {}{}{}", or_none(faults),
                    images.last.empty() ? "" : "; the last: ", images.last));
  print(fmt::format("  features {} used, {} rejected by the filter", health.features_used,
                    health.inputs.features_refused));
}

void print_trust(const RunHealth& health) {
  const std::string others = list_of({{health.starting, "before the filter had begun"},
                                      {health.refused, "refused"},
                                      {health.diverged, "diverged"},
                                      {health.late, "without IMU samples"}});
  print(fmt::format("  health   {} estimates trusted{}{}{}{}", health.trusted,
                    others.empty() ? "" : "; not: ", others,
                    health.suspicion.empty() ? "" : "; the last suspicion: ", health.suspicion));
}

}  // namespace

Json health_to_json(const Recording& recording, const RunOptions& options, const DatasetRun& run) {
  const ImuSummary imu = estimation::summary_of(recording);
  const RunHealth& health = run.health;
  Json all = {{"imu",
               {{"samples", recording.imu.size()},
                {"gaps", imu.gaps},
                {"longest_gap_s", imu.longest_gap_s},
                {"saturated", imu.saturated},
                {"refused", recording.imu_origin.refused}}},
              {"depth",
               {{"samples", options.use_depth ? recording.depth.size() : 0},
                {"refused", recording.depth_origin.refused},
                {"rejected", health.inputs.depth_refused}}},
              {"velocity",
               {{"samples", recording.velocity.size()},
                {"refused", recording.velocity_origin.refused},
                {"rejected", health.inputs.speed_refused}}}};
  if (!is_visual(options)) return all;
  const ImageFaults& images = health.images;
  all["images"] = {{"bad", images.bad},
                   {"frozen", images.frozen},
                   {"dark", images.dark},
                   {"blurred", images.blurred},
                   {"few_features", images.few_features},
                   {"lost", images.lost},
                   {"right_unused", images.right_unused},
                   {"last", images.last}};
  all["features"] = {{"used", health.features_used}, {"rejected", health.inputs.features_refused}};
  all["health"] = {{"trusted", health.trusted}, {"starting", health.starting},
                   {"refused", health.refused}, {"diverged", health.diverged},
                   {"late", health.late},       {"suspicion", health.suspicion}};
  all["restarts"] = Json::array();
  for (const estimation::VisionRestart& restart : health.restarts) {
    all["restarts"].push_back(
        {{"at_s", to_seconds(restart.utime - run.begin)}, {"reason", restart.reason}});
  }
  return all;
}

void print_health(const Recording& recording, const RunOptions& options, const DatasetRun& run) {
  print_imu(recording);
  if (options.use_depth) {
    print_samples("depth", recording.depth.size(), recording.depth_origin.refused,
                  run.health.inputs.depth_refused);
  }
  print_samples("velocity", recording.velocity.size(), recording.velocity_origin.refused,
                run.health.inputs.speed_refused);
  if (!is_visual(options)) return;
  print_images(run.health);
  print_trust(run.health);
  for (const estimation::VisionRestart& restart : run.health.restarts) {
    print(fmt::format("  restart  {:.2f} s after the first image: {}",
                      to_seconds(restart.utime - run.begin), restart.reason));
  }
  if (!run.estimates.empty() && !run.waits_for.empty()) {
    print("  waits    the filter has not begun again; it waits for " + run.waits_for);
  }
}

}  // namespace dive::mission
