// The observed map against a plain list of all its pieces.

#include "planning/world/observed_map.h"

#include <limits>
#include <map>
#include <set>
#include <variant>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/random.h"

namespace dive::planning {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr auto kMapper = ObstacleSource::kMapper;
constexpr auto kScript = ObstacleSource::kScript;

Polytope segment(const Vector3d& from, const Vector3d& to) { return {{from, to}, 0.1}; }

using Cells = std::map<CellKey, std::vector<Polytope>>;

// All updates so far, applied to plain lists.
class Reference {
 public:
  explicit Reference(std::uint64_t seed) : random_(seed) {}

  ObstacleUpdate next(CellKey keys) {
    ObstacleUpdate update{kMapper, ++utime_, {}};
    for (CellKey key = 0; key < keys; ++key) {
      if (random_.uniform() < 0.7) continue;
      MapCell& cell = update.cells.emplace_back(MapCell{key, {}});
      for (auto pieces = random_.bits() % 4; pieces > 0; --pieces) {
        const Vector3d from(random_.uniform(-20, 20), random_.uniform(-20, 20),
                            random_.uniform(-20, 0));
        const Vector3d along(random_.uniform(-2, 2), random_.uniform(-2, 2),
                             random_.uniform(-2, 2));
        cell.pieces.push_back(segment(from, from + along));
      }
      cells_.erase(key);
      if (!cell.pieces.empty()) cells_[key] = cell.pieces;
    }
    return update;
  }
  [[nodiscard]] const Cells& cells() const { return cells_; }
  Random& random() { return random_; }

 private:
  Random random_;
  Utime utime_ = 0;
  Cells cells_;
};

Cells cells_of(const ObservedMap& map) {
  Cells cells;
  map.visit_cells([&](CellKey key, std::span<const ObservedMap::Piece> pieces) {
    for (const auto& piece : pieces) cells[key].push_back(std::get<Polytope>(piece.obstacle.shape));
  });
  return cells;
}

bool are_equal(const Cells& a, const Cells& b) {
  const auto is_same_piece = [](const Polytope& p, const Polytope& q) {
    return p.vertices == q.vertices && p.radius == q.radius;
  };
  return std::ranges::equal(a, b, [&](const auto& x, const auto& y) {
    return x.first == y.first && std::ranges::equal(x.second, y.second, is_same_piece);
  });
}

std::size_t count(const Cells& cells) {
  std::size_t pieces = 0;
  for (const auto& [key, some] : cells) pieces += some.size();
  return pieces;
}

// Pieces come by cell and piece in ascending order.
std::vector<Vector3d> within(const Cells& cells, const AlignedBox3d& box) {
  std::vector<Vector3d> found;
  for (const auto& [key, pieces] : cells) {
    for (const Polytope& piece : pieces) {
      const Vector3d& a = piece.vertices[0];
      const Vector3d& b = piece.vertices[1];
      const Vector3d low = a.cwiseMin(b).array() - piece.radius;
      const Vector3d high = a.cwiseMax(b).array() + piece.radius;
      const bool is_apart =
          (low.array() > box.max().array()).any() || (high.array() < box.min().array()).any();
      if (!is_apart) found.push_back(a);
    }
  }
  return found;
}

RC_GTEST_PROP(ObservedMap, HoldsWhatTheUpdatesLeft, (std::uint64_t seed)) {
  Reference reference(seed);
  ObservedMap map;
  std::vector<std::pair<ObservedMap, Cells>> snapshots;
  for (int round = 0; round < 6; ++round) {
    RC_ASSERT(map.apply(reference.next(200)));
    snapshots.emplace_back(map, reference.cells());
    for (int i = 0; i < 20; ++i) {
      Random& random = reference.random();
      const Vector3d at(random.uniform(-20, 20), random.uniform(-20, 20), random.uniform(-20, 0));
      const AlignedBox3d box(at, at + Vector3d::Constant(random.uniform(0, 8)));
      std::vector<Vector3d> found;
      map.visit(box, [&](const ObservedMap::Piece& piece) {
        found.push_back(std::get<Polytope>(piece.obstacle.shape).vertices[0]);
        return true;
      });
      RC_ASSERT(found == within(reference.cells(), box));
      std::vector<Obstacle> obstacles;
      map.append_within(box, obstacles);
      RC_ASSERT(obstacles.size() == found.size());
    }
  }
  for (const auto& [snapshot, cells] : snapshots) {  // later updates do not change them
    RC_ASSERT(are_equal(cells_of(snapshot), cells));
    RC_ASSERT(snapshot.pieces() == count(cells));
  }
}

const Polytope kPost = segment({3, 2, -5}, {3, 2, -4});

TEST(ObservedMap, TakesNoUpdateTwiceAndEachSourceByItself) {
  ObservedMap map;
  EXPECT_TRUE(map.apply({kMapper, 10, {{7, {kPost}}}}));
  EXPECT_FALSE(map.apply({kMapper, 10, {{7, {}}}})) << "not newer";
  EXPECT_EQ(map.pieces(), 1U);
  EXPECT_TRUE(map.apply({kScript, 20, {{-7, {kPost}}}}));
  EXPECT_TRUE(map.apply({kMapper, 11, {{8, {kPost}}}})) << "older than that of another source";
  EXPECT_EQ(map.pieces(), 3U);
  EXPECT_TRUE(map.apply({kMapper, 12, {{7, {}}, {8, {}}}}));
  EXPECT_EQ(map.pieces(), 1U);
}

TEST(ObservedMap, CountsAsRevisionWhatChangesCells) {
  ObservedMap map;
  EXPECT_EQ(map.revision(), 0);
  EXPECT_TRUE(map.apply({kMapper, 1, {}}));
  EXPECT_EQ(map.revision(), 0);
  EXPECT_TRUE(map.apply({kMapper, 2, {{7, {kPost}}}}));
  EXPECT_TRUE(map.apply({kMapper, 3, {{7, {}}}}));
  EXPECT_EQ(map.revision(), 2) << "it is empty again, but something has been observed";
  EXPECT_EQ(map.pieces(), 0U);
}

TEST(ObservedMap, RefusesUpdatesThatAreNotWellFormed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ObservedMap map;
  Polytope broken = kPost;
  broken.vertices[1].y() = nan;
  Polytope wide = kPost;
  wide.vertices[0].x() = 60.0;
  Polytope far = kPost;
  for (Vector3d& v : far.vertices) v.x() = 2e6;
  Polytope round = kPost;
  round.vertices.resize(kMaxPieceVertices + 1, round.vertices[0]);
  Polytope thick = kPost;
  thick.radius = nan;
  for (const Polytope& piece : {broken, wide, far, round, thick, Polytope{}}) {
    EXPECT_FALSE(map.apply({kMapper, 1, {{7, {kPost, piece}}}}));
  }
  const auto cells = [](std::size_t number, std::size_t pieces) {
    ObstacleUpdate update{kMapper, 1, {}};
    for (std::size_t i = 0; i < number; ++i) {
      update.cells.push_back({static_cast<CellKey>(i), std::vector<Polytope>(pieces, kPost)});
    }
    return update;
  };
  EXPECT_FALSE(map.apply(cells(kMaxUpdateCells + 1, 0)));
  EXPECT_FALSE(map.apply(cells(1, kMaxCellPieces + 1)));
  EXPECT_FALSE(map.apply(cells(kMaxUpdatePieces / kMaxCellPieces + 1, kMaxCellPieces)));
  EXPECT_FALSE(map.apply({kMapper, 1, {{7, {kPost}}, {7, {}}}})) << "a cell named twice";
  EXPECT_FALSE(map.apply({kMapper, 1, {{-1, {kPost}}}})) << "a cell of another source";
  EXPECT_FALSE(map.apply({kScript, 1, {{1, {kPost}}}}));
  EXPECT_EQ(map.revision(), 0);
  EXPECT_TRUE(map.apply({kMapper, 1, {{7, {kPost}}}})) << "a refused update is not the last one";
}

TEST(ObservedMap, NamesItsObstaclesByPlaceAndEndsAVisitWhenAsked) {
  ObservedMap map;
  ASSERT_TRUE(map.apply({kMapper, 1, {{7, {kPost, kPost}}, {8, {kPost}}}}));
  const AlignedBox3d all(Vector3d::Constant(-10), Vector3d::Constant(10));
  std::vector<Obstacle> obstacles;
  map.append_within(all, obstacles);
  ASSERT_EQ(obstacles.size(), 3U);
  EXPECT_EQ(obstacles[0].name, "an observed obstacle at 3.0, 2.0, -4.5");
  int visits = 0;
  map.visit(all, [&](const ObservedMap::Piece&) { return ++visits < 2; });
  EXPECT_EQ(visits, 2);
}

}  // namespace
}  // namespace dive::planning
