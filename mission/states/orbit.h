#pragma once
// <orbit>: stations on a circle, at each of which the bow is turned to the centre. Why there are
// stations: behaviors/orbit.h.

#include "mission/document/rules.h"
#include "mission/states/atomic_state.h"

namespace dive {
struct XmlElement;
}

namespace dive::mission {

class StateReader;

/// The element as written.
struct OrbitSpec {
  Position centre;                 ///< Centre; its z is that of every station.
  Located<double> radius;          ///< m
  Located<double> stations;        ///< Number of stations.
  double first_bearing_deg = 0.0;  ///< Compass bearing of the first station from the centre.
  bool is_clockwise = true;        ///< Direction as viewed from above.
  std::optional<double> arc_deg;   ///< From the first station to the last; absent: once round.
  Located<double> dwell_s;         ///< Time with the bow to the centre at each station, s.
  Located<double> capture_radius;  ///< m
  std::optional<Located<double>> reduced_clearance;  ///< m

  /// Angle at the centre between two stations, degrees.
  [[nodiscard]] double spacing_deg() const;
};

class OrbitState final : public AtomicState {
 public:
  OrbitState(OrbitSpec spec, const Located<std::string>& id);

  /// The stations.
  [[nodiscard]] std::vector<const Goal*> goals() const override;
  [[nodiscard]] Located<double> rest_s() const override;
  void check(const Mission& mission, const StateSpec& spec,
             Diagnostics& diagnostics) const override;
  void check_in_map(const Mission& mission, const StateSpec& spec, MapContext& map) const override;
  [[nodiscard]] std::unique_ptr<behaviors::Behavior> make_behavior(
      const BehaviorSetup& setup) const override;

 private:
  void check_path_between(std::size_t station, const StateSpec& spec, MapContext& map) const;

  OrbitSpec orbit_;
  std::vector<Goal> stations_;
};

void read_orbit(const XmlElement& element, const StateReader& reader, StateSpec& spec);

inline constexpr Rule kOrbitRules[] = {
    {"MIS-ORBIT-SPACING", Severity::kError,
     "The stations of an orbit are at most 90 degrees apart."},
    {"CHK-ORBIT-RADIUS", Severity::kError,
     "The radius of an orbit keeps the bow at the clearance from its centre."},
    {"CHK-ORBIT-CHORD", Severity::kError,
     "No straight line from a station of an orbit to the next cuts through an obstacle."},
};

}  // namespace dive::mission
