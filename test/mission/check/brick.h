#pragma once
// A simple hull for checks whose results have closed forms.

#include "planning/world/world.h"

namespace dive::mission::testing {

/// A vehicle of 1 x 0.4 x 0.2 m.
inline planning::RobotHull brick() {
  planning::ConvexSolid solid;
  solid.name = "brick";
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.2, 0.2}) {
      for (const double z : {-0.1, 0.1}) solid.vertices.emplace_back(x, y, z);
    }
  }
  return {{solid}};
}

}  // namespace dive::mission::testing
