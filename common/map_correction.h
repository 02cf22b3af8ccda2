#pragma once
// Correction of the observed map after a loop closure, by the time of observation: what the vehicle
// observed while its position had drifted moves with the position that it had then.

#include <vector>

#include "common/clock.h"
#include "common/planar_transform.h"

namespace dive {

struct MapCorrection {
  struct Node {
    Utime utime = 0;
    PlanarTransform correction;
  };
  std::vector<Node> nodes;  ///< By ascending time, at least one, at most kMaxMapCorrectionNodes.

  /// Correction of what was observed at `utime`: between two nodes interpolated, outside of them
  /// that of the nearest. Requires a node.
  [[nodiscard]] PlanarTransform at(Utime utime) const;
  /// Correction of the vehicle now. Requires a node.
  [[nodiscard]] const PlanarTransform& newest() const { return nodes.back().correction; }
};

inline constexpr std::size_t kMaxMapCorrectionNodes = 1024;
/// m, along each axis. A correction of the heading moves W's origin, which may be far away.
inline constexpr double kMaxMapCorrection = 1000.0;

/// True if the nodes are as stated, all numbers are finite and no correction is larger than
/// kMaxMapCorrection.
[[nodiscard]] bool is_well_formed(const MapCorrection& correction);

}  // namespace dive
