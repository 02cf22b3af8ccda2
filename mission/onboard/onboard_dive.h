#pragma once
// One dive as the computer on board runs it: each tick the executive steps, and the services around
// it (planner, mapper, visual-inertial estimator) are fed and polled. The same loop for a vehicle
// and for the built-in simulator (mission/README.md has one tick).

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimation/visual_inertial/pipeline/vision_pipeline.h"
#include "mission/document/mission.h"
#include "mission/executive/executive.h"
#include "mission/executive/io.h"
#include "mission/onboard/map_match_service.h"
#include "mission/onboard/mapper_service.h"
#include "mission/onboard/planner_service.h"
#include "mission/onboard/settings.h"
#include "mission/onboard/vehicle_port.h"
#include "mission/onboard/vision_service.h"
#include "planning/mapping/scan_check.h"
#include "planning/mapping/swept_hull.h"
#include "planning/world/observed_map.h"
#include "planning/world/world.h"
#include "vehicle/model.h"

namespace dive::mission {

/// Called every tick, after the step and before its outputs are sent to the vehicle.
using DiveKeeper = std::function<void(const Executive&, const StepOutputs&)>;

/// A mistake of ours in a service on a thread of its own: what it should have answered is missing,
/// and the failsafes of that answer act.
struct ServiceFailure {
  double time_s = 0.0;  ///< Since the start of the dive.
  std::string service;
  std::string message;
};

/// Results of the loop.
struct OnboardReport {
  ExecutiveResult executive;
  int plans = 0;
  int replans = 0;  ///< Number of plans requested while a path was being followed.
  std::vector<TimedTransition> transitions;
  std::vector<FailsafeRecord> failsafes;
  std::vector<ServiceFailure> service_failures;  ///< The first kMaxServiceFailures of a dive.
  planning::ObservedMap observed_map;            ///< The map at the end.
  std::vector<Eigen::Vector3f> observed_points;  ///< Points of that map, in W.
};

inline constexpr std::size_t kMaxServiceFailures = 16;

class OnboardDive {
 public:
  /// Mission and model must outlive it. `world` is not used in an unknown environment. `vision` is
  /// the calibration of the vehicle's cameras and IMU, to which the mission's tags are added:
  /// demanded if the mission uses the visual-inertial estimator, with two cameras if it maps with
  /// the stereo pair; else ignored.
  OnboardDive(const Mission& mission, const planning::World& world, const vehicle::Model& model,
              const OnboardSettings& settings,
              const std::optional<estimation::VisionOptions>& vision, OnLate late);

  /// Runs until the machine has ended, longest_dive_s() has passed, or the port has no next tick.
  [[nodiscard]] OnboardReport run(VehiclePort& port, const DiveKeeper& keeper);

 private:
  void make_vision(const planning::World& world, const estimation::VisionOptions& vision,
                   planning::MapperOptions& mapping, OnLate late);
  void step(VehiclePort& port, Utime now, const DiveKeeper& keeper);
  void ask_services(StepInputs& inputs);
  void take_scan_result(StepInputs& inputs);
  void note_failures(Utime now);
  void feed_services(VehiclePort& port, const StepInputs& inputs, const StepOutputs& outputs);
  void watch_the_way(const RangeScan& scan, const estimation::StateEstimate& estimate);
  void report(const StepOutputs& outputs, Utime now);

  const Mission& mission_;
  const planning::World world_;  ///< The known map; empty in an unknown environment.
  const vehicle::Model& model_;
  const OnboardSettings settings_;
  planning::SweptHull swept_hull_;
  planning::ScanCheck scan_check_;
  std::optional<planning::ObstacleAhead> obstacle_ahead_;  ///< In the last scan.
  PlannerService planner_;
  std::optional<VisionService> vision_;     ///< Present with the visual-inertial estimator.
  std::optional<MapperService> mapper_;     ///< Present with a mapping sensor.
  std::optional<MapMatchService> matcher_;  ///< Present with map fixes in a known map.
  std::optional<Executive> executive_;      ///< From run() on.
  planning::ObservedMap map_;               ///< The owner's; all others have snapshots.
  Utime began_ = 0;
  bool has_position_ = false;  ///< The last estimate was valid.
  OnboardReport report_;
};

}  // namespace dive::mission
