#include "mission/fit/fit_dives.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/assert.h"

namespace dive::mission {
namespace {

using estimation::Drift;
using estimation::MotionFit;
using estimation::MotionRecord;
using estimation::OpenLoopError;

void append(std::vector<OpenLoopError>& all, const std::vector<OpenLoopError>& more) {
  if (all.empty()) {
    all = more;
    return;
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].errors_m.insert(all[i].errors_m.end(), more[i].errors_m.begin(), more[i].errors_m.end());
  }
}

// Errors on each dive of a model that was fitted to all others.
tl::expected<std::vector<OpenLoopError>, std::string> leave_one_out(
    std::span<const MotionRecord> dives, const MotionModel& before,
    const estimation::MotionFitOptions& options, const FitObserver& progress) {
  std::vector<OpenLoopError> errors;
  for (std::size_t out = 0; out < dives.size(); ++out) {
    const double share = static_cast<double>(out + 1) / static_cast<double>(dives.size() + 1);
    progress(fmt::format("fitting without {}", dives[out].name), share);
    std::vector<MotionRecord> others(dives.begin(), dives.end());
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(out));
    const tl::expected<MotionFit, std::string> fit =
        estimation::fit_motion(others, before, options);
    if (!fit) return tl::unexpected(fmt::format("without {}: {}", dives[out].name, fit.error()));
    append(errors, estimation::open_loop_errors(dives.subspan(out, 1), fit->model, kFitHorizons_s,
                                                Drift::kIsCurrent));
  }
  return errors;
}

}  // namespace

bool FitReport::is_better() const {
  return errors.front().after.quantile(0.5) < errors.front().before.quantile(0.5);
}

tl::expected<FitReport, std::string> fit_dives(std::span<const MotionRecord> dives,
                                               std::span<const MotionRecord> held_out,
                                               const MotionModel& before,
                                               const estimation::MotionFitOptions& options,
                                               const FitObserver& progress) {
  DIVE_DEMAND(dives.size() >= (held_out.empty() ? 2U : 1U));
  progress(fmt::format("fitting {} dives", dives.size()), 0.0);
  tl::expected<MotionFit, std::string> fit = estimation::fit_motion(dives, before, options);
  if (!fit) return tl::unexpected(fit.error());
  FitReport report;
  report.leaves_one_out = held_out.empty();
  const std::span<const MotionRecord> measured = held_out.empty() ? dives : held_out;
  const std::vector<OpenLoopError> errors_before =
      estimation::open_loop_errors(measured, before, kFitHorizons_s, Drift::kIsCurrent);
  std::vector<OpenLoopError> errors_after;
  if (held_out.empty()) {
    tl::expected<std::vector<OpenLoopError>, std::string> errors =
        leave_one_out(dives, before, options, progress);
    if (!errors) return tl::unexpected(errors.error());
    errors_after = std::move(*errors);
  } else {
    errors_after =
        estimation::open_loop_errors(held_out, fit->model, kFitHorizons_s, Drift::kIsCurrent);
  }
  for (std::size_t i = 0; i < errors_before.size(); ++i) {
    report.errors.push_back({errors_before[i], errors_after[i]});
  }
  report.slip = estimation::slip_sigmas(measured, fit->model);
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<double>& slip = report.slip[static_cast<std::size_t>(axis)];
    if (slip) fit->model.slip_sigma[axis] = std::clamp(*slip, kMinSlip, 1.0);
  }
  report.fit = std::move(*fit);
  return report;
}

}  // namespace dive::mission
