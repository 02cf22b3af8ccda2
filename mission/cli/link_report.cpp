#include "mission/cli/link_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/json.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;

// The smallest value that is not exceeded by the given share of all values; 0 for no values.
double quantile(std::vector<float> values, double share) {
  if (values.empty()) return 0.0;
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

Json to_json(const CameraInboxStats& cameras) {
  return {{"pairs", cameras.pairs},
          {"unpaired", cameras.unpaired},
          {"images_dropped", cameras.images_dropped},
          {"imu_samples", cameras.imu_samples},
          {"imu_samples_dropped", cameras.imu_samples_dropped}};
}

Json to_json(const LinkStats& stats) {
  Json json = {{"ticks", stats.ticks},
               {"skipped", stats.skipped},
               {"lateness_ms",
                {{"p50", quantile(stats.lateness_ms, 0.5)},
                 {"p99", quantile(stats.lateness_ms, 0.99)},
                 {"p999", quantile(stats.lateness_ms, 0.999)},
                 {"max", quantile(stats.lateness_ms, 1.0)}}},
               {"abort_ms", quantile(stats.abort_ms, 1.0)},
               {"clock_jumps", stats.clock_jumps},
               {"malformed", stats.rejections.malformed},
               {"rejected",
                {{"unauthenticated", stats.rejections.unauthenticated},
                 {"repeated", stats.rejections.repeated},
                 {"unconfirmed", stats.rejections.unconfirmed},
                 {"crowded_out", stats.rejections.crowded_out}}},
               {"refused",
                {{"auth_failed", stats.refused.auth_failed},
                 {"replayed", stats.refused.replayed},
                 {"stale", stats.refused.stale},
                 {"rate_limited", stats.refused.rate_limited}}}};
  if (stats.cameras) json["images"] = to_json(*stats.cameras);
  return json;
}

}  // namespace

std::vector<std::string> describe(const LinkStats& stats) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("{} control tick(s), {} skipped", stats.ticks, stats.skipped));
  if (!stats.lateness_ms.empty()) {
    lines.push_back(fmt::format(
        "control loop late by {:.2f} ms (median), {:.2f} ms (99 %), {:.2f} ms (99.9 %), {:.2f} ms "
        "(most)",
        quantile(stats.lateness_ms, 0.5), quantile(stats.lateness_ms, 0.99),
        quantile(stats.lateness_ms, 0.999), quantile(stats.lateness_ms, 1.0)));
  }
  if (!stats.abort_ms.empty()) {
    lines.push_back(
        fmt::format("{:.1f} ms from the arrival of an abort to the command that executes it",
                    quantile(stats.abort_ms, 1.0)));
  }
  const link::Refusals& refused = stats.refused;
  lines.push_back(fmt::format(
      "operator requests refused: {} not authenticated, {} repeated, {} too late; {} abort(s) "
      "beyond the rate limit; {} jump(s) of a sensor's clock",
      refused.auth_failed, refused.replayed, refused.stale, refused.rate_limited,
      stats.clock_jumps));
  const link::Rejections& rejections = stats.rejections;
  lines.push_back(fmt::format(
      "packets rejected: {} malformed, {} not authenticated, {} repeated, {} from unconfirmed "
      "senders, {} beyond their sender's allowance",
      rejections.malformed, rejections.unauthenticated, rejections.repeated, rejections.unconfirmed,
      rejections.crowded_out));
  if (!stats.cameras) return lines;
  const CameraInboxStats& cameras = *stats.cameras;
  lines.push_back(fmt::format(
      "image pairs: {}; left images alone: {}; dropped: {}; IMU samples: {}, {} dropped",
      cameras.pairs, cameras.unpaired, cameras.images_dropped, cameras.imu_samples,
      cameras.imu_samples_dropped));
  return lines;
}

Json to_json(const LinkedResult& result, bool with_stats) {
  // Values that need ground truth are null: dive sim reports them.
  Json json = {{"outcome", result.outcome},       {"final_state", result.final_state},
               {"cause", result.cause},           {"duration_s", result.duration_s},
               {"distance_m", result.distance_m}, {"min_clearance_m", nullptr},
               {"collisions", nullptr},           {"collision_list", nullptr},
               {"final_error_m", nullptr},        {"final_sigma_m", result.final_sigma_m},
               {"replans", result.replans},       {"transitions", to_json(result.transitions)}};
  json["service_failures"] = Json::array();
  for (const ServiceFailure& failure : result.service_failures) {
    json["service_failures"].push_back(
        {{"time_s", failure.time_s}, {"service", failure.service}, {"message", failure.message}});
  }
  if (with_stats) json["stats"] = to_json(result.stats);
  return json;
}

}  // namespace dive::mission
