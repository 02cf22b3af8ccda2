#include "common/map_correction.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"

namespace dive {

PlanarTransform MapCorrection::at(Utime utime) const {
  DIVE_DEMAND(!nodes.empty());
  const auto after = std::ranges::upper_bound(nodes, utime, {}, &Node::utime);
  if (after == nodes.begin()) return nodes.front().correction;
  if (after == nodes.end()) return nodes.back().correction;
  const Node& before = *std::prev(after);
  const double share = to_seconds(utime - before.utime) / to_seconds(after->utime - before.utime);
  const PlanarTransform& a = before.correction;
  const PlanarTransform& b = after->correction;
  return {a.yaw + share * wrap_angle(b.yaw - a.yaw),
          a.translation + share * (b.translation - a.translation)};
}

bool is_well_formed(const MapCorrection& correction) {
  const std::vector<MapCorrection::Node>& nodes = correction.nodes;
  if (nodes.empty() || nodes.size() > kMaxMapCorrectionNodes) return false;
  const bool ascends = std::ranges::adjacent_find(nodes, [](const auto& a, const auto& b) {
                         return a.utime >= b.utime;
                       }) == nodes.end();
  return ascends && std::ranges::all_of(nodes, [](const MapCorrection::Node& node) {
           return std::isfinite(node.correction.yaw) &&
                  node.correction.translation.cwiseAbs().maxCoeff() <= kMaxMapCorrection &&
                  node.correction.translation.allFinite();
         });
}

}  // namespace dive
