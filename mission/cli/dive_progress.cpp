#include "mission/cli/dive_progress.h"

#include <chrono>
#include <memory>

#include <fmt/format.h>

namespace dive::mission {
namespace {

constexpr std::size_t kQueue = 16U << 10U;  // bytes
constexpr auto kLastLine = std::chrono::seconds(1);

}  // namespace

DiveProgress::DiveProgress()
    : on_terminal_(ProgressLine().on_terminal()),
      output_(kQueue, WhenFull::kDrop,
              [line = std::make_shared<ProgressLine>()](std::span<const std::uint8_t> text) {
                line->show({reinterpret_cast<const char*>(text.data()), text.size()});
              }) {}

DiveProgress::~DiveProgress() { output_.close(kLastLine); }

void DiveProgress::observe(const StepInputs& inputs, const StepOutputs& outputs) {
  if (inputs.now < next_) return;
  next_ = inputs.now + (on_terminal_ ? 1 : 10) * kMicrosecondsPerSecond;
  const Status& status = outputs.status;
  const std::string goal = status.goal.empty() ? "" : " -> " + status.goal;
  const std::string clearance =
      status.clearance_m > 0.0 ? fmt::format("{:.2f} m", status.clearance_m) : "-";
  const bool sees = outputs.estimate.source == estimation::EstimatorKind::kVisualInertial;
  output_.push(
      fmt::format("{:6.1f} s  {:<28} to go {:5.1f} m {:4.0f} s  depth {:4.1f} m  "
                  "clearance {}{}{}",
                  to_seconds(inputs.now), status.state + goal, status.distance_to_go_m,
                  status.time_to_go_s, status.depth_m, clearance, sees ? "  visual-inertial" : "",
                  status.rung == "none" ? "" : "  [" + status.rung + "]"));
}

}  // namespace dive::mission
