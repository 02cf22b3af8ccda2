#pragma once
// Our estimate beside another estimator's trajectory of the same recording.

#include <string>

#include <nlohmann/json_fwd.hpp>
#include <tl/expected.hpp>

#include "common/clock.h"
#include "estimation/dataset/recording.h"
#include "estimation/dataset/trajectory.h"
#include "mission/cli/estimate_accuracy.h"

namespace dive::mission {

/// Both accuracies over the time that both trajectories cover, so that neither gains by estimating
/// less.
struct Comparison {
  Utime begin = 0;
  Utime end = 0;
  Accuracy ours;
  Accuracy theirs;
};

/// Reads a file in the TUM format. An error names the file, and the line if there is one: it cannot
/// be read, has fewer than three poses, or none in the time of the recording's images and ground
/// truth.
[[nodiscard]] tl::expected<estimation::Trajectory, std::string> read_other(
    const std::string& path, const estimation::Recording& recording);

[[nodiscard]] Comparison compare(const estimation::Recording& recording,
                                 const estimation::Trajectory& ours,
                                 const estimation::Trajectory& theirs);

[[nodiscard]] nlohmann::ordered_json to_json(const Comparison& comparison, const std::string& path);
void print_comparison(const Comparison& comparison, const std::string& path);

}  // namespace dive::mission
