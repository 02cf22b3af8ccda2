#pragma once
// Which objects of the known map are gone, by many scans.
//
// An object is gone when
//   - each cell of it that scans have shown at all is free: none is occupied;
//   - these free cells, each by 3 scans or more, are 40 % of its cells or more: an object that is
//     seen in part stays;
//   - 6 scans or more saw through it, from 3 places or more that are half a metre apart: what
//     blinds a sensor in one direction does not move with the view.
// Its cells that are not free remain obstacles until they are, because what is there was not
// observed. When two scans show a cell occupied, all of the object is an obstacle again, and the
// evidence against it is dropped.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "planning/map_matching/object_cells.h"
#include "planning/map_matching/object_scan.h"
#include "planning/world/obstacle_update.h"

namespace dive::planning {

class AbsenceTracker {
 public:
  static constexpr int kScansOfCell = 3;
  static constexpr int kScans = 6;
  static constexpr std::size_t kPlaces = 3;
  static constexpr double kApart = 0.5;  ///< m between two places.
  static constexpr double kShare = 0.4;  ///< Share of an object's cells.

  /// Demands objects.
  explicit AbsenceTracker(std::shared_ptr<const ObjectCells> objects);

  /// Adds what one scan from `from_W` shows; scans come in the order of their times. Returns the
  /// change of the map, of source kAbsence, if there is one.
  [[nodiscard]] std::optional<ObstacleUpdate> add(Utime scan_utime, const Eigen::Vector3d& from_W,
                                                  std::span<const CellSighting> sightings);

 private:
  struct Cell {
    int free = 0;         ///< Scans that show it free, since two that showed it occupied.
    int free_in_row = 0;  ///< Scans that show it free, since one that showed it occupied.
    int occupied = 0;  ///< Scans that show it occupied, since three in a row that showed it free.
    bool is_remnant = false;  ///< An obstacle by itself: the object is gone, but not this cell.
  };
  struct Evidence {
    std::vector<Cell> cells;
    std::vector<Eigen::Vector3d> places_W;  ///< Places from which rays passed through it.
    int scans = 0;                          ///< Number of scans whose rays passed through it.
    bool is_absent = false;
  };

  static void add(const Eigen::Vector3d& from_W, std::span<const CellSighting> sightings,
                  Evidence& evidence);
  [[nodiscard]] static double seen_share(const Evidence& evidence);
  [[nodiscard]] static bool is_gone(const Evidence& evidence);
  void report(std::size_t index, ObstacleUpdate& update);

  std::shared_ptr<const ObjectCells> objects_;
  std::vector<Evidence> evidence_;  ///< By object.
};

}  // namespace dive::planning
