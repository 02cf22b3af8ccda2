#pragma once
// What has been seen of unknown water, kept so that what is near to a path or in a column of water
// is found without looking at the rest: a grid of columns over x and y, each with the pieces whose
// boxes reach into it. Private to mission/executive.

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/world/overhead.h"
#include "planning/world/seen.h"
#include "planning/world/world.h"

namespace dive::mission {

class SeenPieces {
 public:
  SeenPieces();

  /// As planning::SeenMap::apply(): false, and nothing changes, for an update that is not
  /// well-formed or not newer than the last. Costs what it brings, whatever was there before.
  bool apply(const planning::MapUpdate& update);

  [[nodiscard]] std::size_t size() const { return slots_.size() - free_.size(); }

  // Neither of these allocates.

  /// Does a piece reach into the tube of `radius` from p_W up to the surface? planning::is_above().
  [[nodiscard]] bool is_above(const Eigen::Vector3d& p_W, double radius);
  /// As planning::ground_below(), of the pieces.
  [[nodiscard]] std::optional<double> ground_below(const Eigen::Vector3d& p_W) const;

  /// Begins a collection of pieces, none of which is collected twice.
  void begin_collection();
  /// Appends those whose boxes come within `box`.
  void collect(const Eigen::AlignedBox3d& box, std::vector<planning::Obstacle>& out);

 private:
  struct Slot {
    planning::Obstacle piece;     ///< In W.
    Eigen::AlignedBox3d box;      ///< Empty: the slot is free.
    std::uint64_t collected = 0;  ///< In which collection.
  };
  using Slots = std::vector<std::uint32_t>;
  /// A rectangle of columns, ends included.
  struct Columns {
    std::int32_t x0, x1, y0, y1;
  };
  [[nodiscard]] static Columns columns_of(const Eigen::AlignedBox3d& box);
  [[nodiscard]] static std::int64_t column(std::int32_t x, std::int32_t y);
  void add(const planning::Polytope& piece, Slots& cell);
  void remove(std::uint32_t slot);
  /// Calls `visit` with each of their pieces, and perhaps others, until it says false. One that
  /// lies in several columns comes several times.
  template <class Visit>
  void visit(const Columns& columns, Visit&& visit) const;

  std::vector<Slot> slots_;
  Slots free_;
  std::unordered_map<planning::CellKey, Slots> cells_;
  std::unordered_map<std::int64_t, Slots> columns_;
  std::optional<Utime> newest_;
  std::uint64_t collection_ = 0;
  planning::PlanView scratch_;
};

}  // namespace dive::mission
