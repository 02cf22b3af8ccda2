#include "mission/cli/estimate_accuracy.h"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "estimation/dataset/dataset_run.h"
#include "mission/cli/terminal.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;
using estimation::Alignment;
using estimation::RelativeError;
using estimation::Trajectory;

constexpr double kStretches_m[] = {1.0, 5.0, 10.0, 25.0, 50.0, 100.0};

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

}  // namespace

Trajectory trajectory_of(const Estimates& estimates) {
  Trajectory trajectory;
  for (const estimation::StateEstimate& e : estimates) trajectory.push_back({e.utime, e.X_WB});
  return trajectory;
}

Accuracy accuracy_of(const estimation::Recording& recording, const Trajectory& estimate) {
  Accuracy accuracy;
  accuracy.distance_m = estimation::length_of(estimate);
  const Trajectory truth = estimation::true_trajectory(recording);
  const std::vector<estimation::PosePair> pairs = estimation::pair_up(estimate, truth);
  if (pairs.empty()) return accuracy;

  Trajectory followed;
  for (const estimation::PosePair& pair : pairs) followed.push_back({pair.utime, pair.truth});
  accuracy.poses = static_cast<int>(pairs.size());
  accuracy.distance_m = estimation::length_of(followed);
  if (const auto X = estimation::align(pairs, Alignment::kYawAndTranslation)) {
    accuracy.yaw_aligned = estimation::absolute_error(pairs, *X);
  }
  if (const auto X = estimation::align(pairs, Alignment::kRigid)) {
    accuracy.rigidly_aligned = estimation::absolute_error(pairs, *X);
  }
  if (!recording.has_true_attitude) return accuracy;
  accuracy.drift_percent = estimation::drift_percent(pairs);
  for (const double distance : kStretches_m) {
    const RelativeError error = estimation::relative_error(pairs, distance);
    if (error.stretches > 0) accuracy.relative.push_back(error);
  }
  return accuracy;
}

Accuracy accuracy_of(const estimation::Recording& recording, const Estimates& estimates) {
  Accuracy accuracy = accuracy_of(recording, trajectory_of(estimates));
  if (accuracy.poses > 0 && recording.has_true_attitude) {
    accuracy.nees = estimation::nees(estimates, estimation::true_trajectory(recording));
  }
  return accuracy;
}

Json to_json(const Accuracy& accuracy) {
  Json relative = Json::array();
  for (const RelativeError& error : accuracy.relative) {
    relative.push_back({{"distance_m", error.distance_m},
                        {"mean_m", error.mean_m},
                        {"percent", error.percent},
                        {"mean_deg", error.mean_deg}});
  }
  const auto rmse = [](const std::optional<estimation::AbsoluteError>& error) {
    return error ? Json(error->rmse_m) : Json(nullptr);
  };
  return {{"ate_m", rmse(accuracy.yaw_aligned)},
          {"ate_rigid_m", rmse(accuracy.rigidly_aligned)},
          {"drift_percent", or_null(accuracy.drift_percent)},
          {"rpe", std::move(relative)},
          {"nees_position", accuracy.nees ? Json(accuracy.nees->position) : Json(nullptr)},
          {"nees_orientation", accuracy.nees ? Json(accuracy.nees->orientation) : Json(nullptr)}};
}

void print_accuracy(const Accuracy& accuracy) {
  if (accuracy.yaw_aligned) {
    print(fmt::format(
        "  ATE      {:.3f} m, {:.2f} deg (yaw and translation aligned), at most "
        "{:.3f} m",
        accuracy.yaw_aligned->rmse_m, accuracy.yaw_aligned->rmse_deg, accuracy.yaw_aligned->max_m));
  }
  if (accuracy.rigidly_aligned) {
    print(fmt::format("           {:.3f} m (rigidly aligned)", accuracy.rigidly_aligned->rmse_m));
  }
  for (const RelativeError& error : accuracy.relative) {
    print(fmt::format("  RPE      {:.3f} m ({:.2f} %), {:.2f} deg in {:g} m", error.mean_m,
                      error.percent, error.mean_deg, error.distance_m));
  }
  if (accuracy.drift_percent) print(fmt::format("  drift    {:.2f} %", *accuracy.drift_percent));
  if (accuracy.nees) {
    print(fmt::format("  NEES     position {:.2f}, orientation {:.2f} (3: consistent)",
                      accuracy.nees->position, accuracy.nees->orientation));
  }
}

}  // namespace dive::mission
