#pragma once
// What is above and below the vehicle, where it has been, and what it has used up since it was last
// in open water. Private to mission/executive.

#include <optional>
#include <span>

#include <Eigen/Core>

#include "behaviors/trail.h"
#include "common/clock.h"
#include "estimation/state_estimate.h"
#include "mission/document/mission.h"
#include "mission/executive/changed_map.h"

namespace dive::mission {

/// What there was when the vehicle was last in open water.
struct Usable {
  Utime at = 0;
  double battery_fraction = 1.0;
};

class Surroundings {
 public:
  /// Mission and map must outlive it.
  Surroundings(const Mission& mission, ChangedMap& map);

  /// Before the first look(): where the vehicle has been in another executive's time.
  void restore(std::span<const behaviors::Trail::Crumb> trail);
  /// And, under an overhead, what there was when it was last in open water.
  void restore(const Usable& usable) { usable_ = usable; }

  /// Once a tick. `declared_roof` is what the active leaf says of its way; nothing: it does not
  /// swim to goals.
  void look(Utime now, const estimation::StateEstimate& estimate, std::optional<bool> declared_roof,
            double battery_fraction);

  /// Something is above the vehicle.
  [[nodiscard]] bool is_under() const { return is_under_; }
  /// Nothing is, nor where it may drift to: it can go straight up.
  [[nodiscard]] bool open_above() const { return open_above_; }
  /// m above the ground straight below, looked for now and then; none where there is none.
  [[nodiscard]] std::optional<double> altitude_m() const { return altitude_m_; }
  [[nodiscard]] const behaviors::Trail& trail() const { return trail_; }
  [[nodiscard]] const std::optional<Usable>& last_in_open_water() const { return usable_; }
  /// Of the time or the energy that was usable where the overhead began, whichever is more; 0 in
  /// open water. 1: all of it.
  [[nodiscard]] double spent(Utime now, Utime started_at, double battery_fraction) const;

 private:
  [[nodiscard]] bool is_declared_under(const Eigen::Vector3d& p_W,
                                       std::optional<bool> declared_roof);

  const Mission& mission_;
  ChangedMap& map_;
  behaviors::Trail trail_;
  std::optional<behaviors::Trail> declared_;  ///< In unknown water: by what the mission says.
  std::optional<Usable> usable_;
  std::optional<double> altitude_m_;
  Utime next_sounding_ = 0;
  bool is_under_ = false;
  bool open_above_ = false;
};

}  // namespace dive::mission
