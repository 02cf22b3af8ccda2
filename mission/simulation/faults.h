#pragma once
// Things that go wrong, put between the simulated vehicle and the executive.

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
  kBattery,      ///< The charge falls to nothing.
  kTemperature,  ///< 90 degrees in the hull.
  kImuSilent,    ///< No more samples ...
  kImuNan,       ///< ... or such as are no attitude.
  kDepthSilent,
  kDepthNan,
  kDepthFrozen,  ///< The last value, again and again.
  kHealthSilent,
  kPlannerFails,   ///< Answers, but finds nothing any more.
  kPlannerSilent,  ///< Does not answer any more.
  kBlocked,        ///< Something falls into the trail behind the vehicle, and is seen: 2 m back,
                   ///< as soon as that is 1.5 m away.
  kAbort,          ///< Topside says abort.
  kRangeSilent,    ///< In unknown water: nothing more is seen ...
  kRangeFrozen,    ///< ... or the last sweep, again and again, with new stamps.
  // Where the cameras' estimator is used:
  kCameraBlackout,      ///< Black pictures ...
  kCameraFrozen,        ///< ... the last one again and again ...
  kCameraMissing,       ///< ... none ...
  kCameraBlur,          ///< ... blurred ones ...
  kCameraRightMissing,  ///< ... or none of the right camera.
  kDepthWild,           ///< Back and forth by metres.
};
inline constexpr std::size_t kFaultCount = 21;
/// A vehicle must come to safety after each of the first so many, whenever it happens. With a depth
/// sensor that lies for ever it cannot know where the surface is.
inline constexpr std::size_t kSurvivableCount = 20;

[[nodiscard]] std::string_view to_string(FaultKind kind);
[[nodiscard]] std::optional<FaultKind> find_fault(std::string_view name);

/// From `at_s` on, for so long.
struct Fault {
  FaultKind kind = FaultKind::kLeak;
  double at_s = 0.0;
  double for_s = std::numeric_limits<double>::infinity();
};

class FaultInjector {
 public:
  explicit FaultInjector(std::vector<Fault> faults);

  /// One more, decided while the dive is under way.
  void add(const Fault& fault);
  /// Changes `inputs` to what a vehicle with these faults receives; obstacles that appear in this
  /// tick are appended to `appearing`.
  void apply(const vehicle::GroundTruth& truth, StepInputs& inputs,
             std::vector<AppearingObstacle>& appearing);
  /// As of the last apply(): for what is not among the inputs.
  [[nodiscard]] bool is_on(FaultKind kind) const;
  /// Likewise, what is heard of the inertial unit.
  void apply(vehicle::InertialSamples& samples) const;

 private:
  [[nodiscard]] bool begins(FaultKind kind);
  void spoil_sensors(StepInputs& inputs);
  static void drop_scans(StepInputs& inputs);
  void spoil_depth(StepInputs& inputs);
  void spoil_plan(StepInputs& inputs) const;
  void drop_something(std::vector<AppearingObstacle>& appearing);

  std::vector<Fault> faults_;
  std::vector<bool> begun_;  ///< By index in faults_.
  double now_s_ = 0.0;
  std::optional<DepthSample> frozen_;
  bool wild_up_ = false;
  std::deque<Eigen::Vector3d> been_W_;  ///< Where the vehicle was, every kStep m.
};

}  // namespace dive::mission
