#pragma once
// The lines that a picture of an export shows. Private to mission/export.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "mission/export/exported.h"

namespace dive::mission {

using Colour = std::array<std::uint8_t, 3>;  ///< Red, green, blue.

inline constexpr Colour kMapColour{150, 150, 150};
inline constexpr Colour kCloudColour{90, 90, 90};

struct ColouredLine {
  std::string name;
  Colour colour{};
  std::vector<Eigen::Vector3d> points_W;
};

/// The true and the estimated track, where they are known, and every planned path.
[[nodiscard]] std::vector<ColouredLine> lines_of(const Exported& exported);

}  // namespace dive::mission
