#pragma once
// The motion of a dive as its log has it: efforts, attitude, depth and position fixes. Ground
// truth, which simulated dives record, is not read.

#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/source_text.h"
#include "estimation/motion_fit/motion_record.h"
#include "mission/executive/io.h"

namespace dive::mission {

/// Collects the motion of a dive tick by tick. Fixes are what range scans say of the position in a
/// known map; in dives without these, the poses of the visual-inertial estimator, with the steps
/// taken out by which tags and loop closures correct them: what counts is the motion from fix to
/// fix.
class MotionCollector {
 public:
  explicit MotionCollector(std::string name) { record_.name = std::move(name); }

  void add(const StepInputs& inputs, const StepOutputs& outputs);
  /// The collected motion; nothing can be added afterwards.
  [[nodiscard]] estimation::MotionRecord take();

 private:
  void add_vision(const estimation::VisionEstimate& vision);

  estimation::MotionRecord record_;
  std::vector<MapFix> vision_fixes_;
  std::optional<ImuSample> imu_;
  std::optional<estimation::VisionEstimate> vision_;   ///< The last good one.
  Eigen::Vector2d steps_W_ = Eigen::Vector2d::Zero();  ///< Sum of its corrections so far, m.
};

struct RecordedMotion {
  estimation::MotionRecord motion;
  SourceText vehicle;  ///< The vehicle's description.
};

struct NoMotion {
  std::string message;  ///< "PATH: what is wrong, and what to do".
  /// False if the log cannot be read or its header is damaged; true if its dive has no efforts, no
  /// fixes, or too few of them.
  bool is_read = false;
};

[[nodiscard]] tl::expected<RecordedMotion, NoMotion> read_motion(const std::string& log_path);

}  // namespace dive::mission
