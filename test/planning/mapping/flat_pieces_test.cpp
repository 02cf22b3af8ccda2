// Flat pieces against the triangles that they are made of, with random bumpy and folded sheets.

#include "planning/mapping/flat_pieces.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "planning/world/obstacle_update.h"
#include "test/planning/mapping/flat_distance.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

TEST(FlatPiecesTest, HoldTheirTrianglesAndNothingFarOff) {
  Random random(5);
  for (int round = 0; round < 200; ++round) {
    // A bumpy, folded sheet with holes.
    std::vector<Vector3f> points;
    std::vector<Triangle> triangles;
    const double bump = random.uniform(0.0, 0.1);
    const double fold = random.uniform(-1.5, 1.5);
    constexpr std::uint32_t n = 12;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t k = 0; k < n; ++k) {
        const double x = 0.1 * i;
        const double y = 0.1 * k;
        points.emplace_back(static_cast<float>(x), static_cast<float>(y),
                            static_cast<float>(bump * random.normal() * 0.3 +
                                               (x > 0.55 ? fold * (x - 0.55) : 0.0)));
      }
    }
    for (std::uint32_t i = 0; i + 1 < n; ++i) {
      for (std::uint32_t k = 0; k + 1 < n; ++k) {
        if (random.uniform() < 0.15) continue;
        triangles.push_back({i * n + k, i * n + k + 1, (i + 1) * n + k});
        triangles.push_back({(i + 1) * n + k, i * n + k + 1, (i + 1) * n + k + 1});
      }
    }
    FlatPieceOptions options;
    std::vector<Polytope> pieces;
    flat_pieces(points, triangles, options, pieces);
    const auto to_pieces = [&](const Vector3d& p) {
      double least = std::numeric_limits<double>::infinity();
      for (const Polytope& piece : pieces) least = std::min(least, to_piece(p, piece));
      return least;
    };
    const auto to_surface = [&](const Vector3d& p) {
      double least = std::numeric_limits<double>::infinity();
      for (const Triangle& t : triangles) {
        least =
            std::min(least, to_triangle(p, points[t[0]].cast<double>(), points[t[1]].cast<double>(),
                                        points[t[2]].cast<double>()));
      }
      return least;
    };
    for (const Triangle& t : triangles) {
      const double u = random.uniform();
      const double v = random.uniform() * (1.0 - u);
      const Vector3d p = (points[t[0]] + static_cast<float>(u) * (points[t[1]] - points[t[0]]) +
                          static_cast<float>(v) * (points[t[2]] - points[t[0]]))
                             .cast<double>();
      EXPECT_LE(to_pieces(p), 1e-4);
    }
    for (const Polytope& piece : pieces) {
      ASSERT_LE(piece.vertices.size(), kMaxPieceVertices);
      Vector3d p = Vector3d::Zero();
      double sum = 0.0;
      for (const Vector3d& vertex : piece.vertices) {
        const double weight = random.uniform();
        p += weight * vertex;
        sum += weight;
      }
      EXPECT_LE(to_surface(p / sum), 0.22);
    }
  }
}

}  // namespace
}  // namespace dive::planning
