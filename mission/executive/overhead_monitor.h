#pragma once
// The solids above and below the vehicle, its trail, and the time and energy used since it was last
// in open water. Private to mission/executive.

#include <optional>
#include <span>

#include <Eigen/Core>

#include "behaviors/trail.h"
#include "common/clock.h"
#include "estimation/state_estimate.h"
#include "mission/document/mission.h"
#include "mission/executive/map_view.h"

namespace dive::mission {

/// Possible drift during an ascent from rest in still water, m.
inline constexpr double kAscentDrift = 0.2;

/// Resources when the vehicle was last in open water.
struct Usable {
  Utime at = 0;
  double battery_fraction = 1.0;
};

class OverheadMonitor {
 public:
  /// Mission and map must outlive this object.
  OverheadMonitor(const Mission& mission, MapView& map);

  /// Before the first update(): the trail recorded by an earlier executive.
  void restore(std::span<const behaviors::Trail::Breadcrumb> trail,
               double spacing = behaviors::kTrailSpacing);
  /// Under an overhead: the resources when the vehicle was last in open water.
  void restore(const Usable& usable) { usable_ = usable; }

  /// After a loop closure: moves the trail.
  void move(const MapCorrection& correction);

  /// Called once per tick. `declared_overhead`: overhead declared by the active atomic state;
  /// empty: it does not swim to goals.
  void update(Utime now, const estimation::StateEstimate& estimate,
              std::optional<bool> declared_overhead, double battery_fraction);

  /// True if something is above the vehicle.
  [[nodiscard]] bool has_overhead() const { return has_overhead_; }
  /// True if nothing solid is above the vehicle or where it may drift to: a vertical ascent is
  /// possible.
  [[nodiscard]] bool open_above() const { return open_above_; }
  /// Height (m) above the ground vertically below, updated periodically; empty without ground.
  [[nodiscard]] std::optional<double> altitude_m() const { return altitude_m_; }
  [[nodiscard]] const behaviors::Trail& trail() const { return trail_; }
  [[nodiscard]] const std::optional<Usable>& last_in_open_water() const { return usable_; }
  /// Fraction used of the time or energy (the larger) that was usable where the overhead began; 0
  /// in open water, 1: all of it.
  [[nodiscard]] double budget_used(Utime now, Utime started_at, double battery_fraction) const;

 private:
  [[nodiscard]] bool is_declared_overhead(const Eigen::Vector3d& p_W,
                                          std::optional<bool> declared_overhead, Utime now);

  const Mission& mission_;
  MapView& map_;
  behaviors::Trail trail_;
  /// True if something solid is above, in an unknown environment: by the mission's declarations.
  std::optional<behaviors::Trail> declared_;
  std::optional<Usable> usable_;
  std::optional<double> altitude_m_;
  Utime next_sounding_ = 0;
  bool has_overhead_ = false;
  bool open_above_ = false;
};

}  // namespace dive::mission
