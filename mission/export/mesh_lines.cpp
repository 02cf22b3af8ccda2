#include "mission/export/mesh_lines.h"

#include <fmt/format.h>

namespace dive::mission {
namespace {

constexpr Colour kTruth{0, 110, 190};
constexpr Colour kEstimate{230, 120, 0};
constexpr Colour kPlan{0, 150, 90};

}  // namespace

std::vector<ColouredLine> lines_of(const Exported& exported) {
  ColouredLine truth{"true track", kTruth, {}};
  ColouredLine estimate{"estimated track", kEstimate, {}};
  for (const ExportedSample& sample : exported.track) {
    if (sample.truth) truth.points_W.push_back(sample.truth->p);
    if (sample.estimate) estimate.points_W.push_back(sample.estimate->p);
  }
  std::vector<ColouredLine> lines;
  for (ColouredLine* track : {&truth, &estimate}) {
    if (track->points_W.size() > 1) lines.push_back(std::move(*track));
  }
  for (const ExportedPath& path : exported.paths) {
    ColouredLine line{fmt::format("plan to {}", path.goal), kPlan, {}};
    for (const Pose& waypoint : path.waypoints) line.points_W.push_back(waypoint.p);
    if (line.points_W.size() > 1) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace dive::mission
