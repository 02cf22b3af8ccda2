#pragma once
// What happened in a run of `dive estimate`: health of the estimator, restarts, and measurements
// that were missing or rejected.

#include <nlohmann/json_fwd.hpp>

#include "estimation/dataset/dataset_run.h"
#include "estimation/dataset/recording.h"

namespace dive::mission {

/// Keys for the result's object. Those of images, features and health are the visual-inertial
/// estimator's.
[[nodiscard]] nlohmann::ordered_json health_to_json(const estimation::Recording& recording,
                                                    const estimation::RunOptions& options,
                                                    const estimation::DatasetRun& run);
/// Prints one line per sensor, of the health, and per restart.
void print_health(const estimation::Recording& recording, const estimation::RunOptions& options,
                  const estimation::DatasetRun& run);

}  // namespace dive::mission
