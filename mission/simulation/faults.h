#pragma once
// Injected faults, between the simulated vehicle and the executive.

#include <deque>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mission/executive/io.h"
#include "mission/simulation/appearing_obstacle.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

enum class FaultKind {
  kLeak,
  kBattery,      ///< The charge falls to zero.
  kTemperature,  ///< The temperature in the hull rises to 90 degrees.
  kImuSilent,    ///< No more attitude samples.
  kImuNan,       ///< Attitude samples of NaN.
  kDepthSilent,
  kDepthNan,
  kDepthFrozen,  ///< The last depth is repeated.
  kHealthSilent,
  kPlannerFails,   ///< All plans fail.
  kPlannerSilent,  ///< No more plans arrive.
  /// An obstacle appears on the trail 2 m back, once that place is 1.5 m away, and is observed.
  kBlocked,
  kAbort,        ///< Topside requests an abort.
  kRangeSilent,  ///< No more scans.
  kRangeFrozen,  ///< The last scan is repeated, with new stamps.
  // With the visual-inertial estimator:
  kCameraBlackout,      ///< Black images.
  kCameraFrozen,        ///< The last images are repeated.
  kCameraMissing,       ///< No more images.
  kCameraBlur,          ///< Blurred images.
  kCameraRightMissing,  ///< No more images of the right camera.
  kDepthWild,           ///< The depth jumps back and forth by metres.
};
inline constexpr std::size_t kFaultCount = 21;
/// Number of faults, the first ones, after each of which the vehicle must reach safety at any time.
/// Not after kDepthWild: with a wrong depth for ever the surface cannot be found.
inline constexpr std::size_t kSurvivableCount = 20;

[[nodiscard]] std::string_view to_string(FaultKind kind);
[[nodiscard]] std::optional<FaultKind> find_fault(std::string_view name);

/// A fault from `at_s` on, for `for_s`.
struct Fault {
  FaultKind kind = FaultKind::kLeak;
  double at_s = 0.0;
  double for_s = std::numeric_limits<double>::infinity();
};

class FaultInjector {
 public:
  explicit FaultInjector(std::vector<Fault> faults);

  /// Adds a fault during the dive.
  void add(const Fault& fault);
  /// Changes `inputs` to what a vehicle with these faults receives; obstacles that appear in this
  /// tick are appended to `appearing`.
  void apply(const vehicle::GroundTruth& truth, StepInputs& inputs,
             std::vector<AppearingObstacle>& appearing);
  /// True if the fault is active as of the last apply(); for data that are not among the inputs.
  [[nodiscard]] bool is_on(FaultKind kind) const;
  /// Changes the raw IMU samples likewise.
  void apply(vehicle::InertialSamples& samples) const;

 private:
  [[nodiscard]] bool begins(FaultKind kind);
  void spoil_sensors(StepInputs& inputs);
  static void drop_scans(StepInputs& inputs);
  void spoil_depth(StepInputs& inputs);
  void spoil_plan(StepInputs& inputs) const;
  void drop_something(std::vector<AppearingObstacle>& appearing);

  std::vector<Fault> faults_;
  std::vector<bool> begun_;  ///< True for faults that have begun, by index in faults_.
  double now_s_ = 0.0;
  std::optional<DepthSample> frozen_;
  bool wild_up_ = false;
  std::deque<Eigen::Vector3d> been_W_;  ///< Past positions of the vehicle, every kStep m.
};

}  // namespace dive::mission
