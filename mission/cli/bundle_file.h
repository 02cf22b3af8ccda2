#pragma once
// Verified bundles as files of `dive check`, `dive run` and `dive supervise` (mission/bundle/).

#include <optional>

#include <tl/expected.hpp>

#include "common/diagnostic.h"
#include "common/motion_model.h"
#include "mission/check/check.h"
#include "mission/cli/commands.h"
#include "mission/cli/loading.h"
#include "mission/cli/output.h"
#include "vehicle/link/key.h"

namespace dive::mission {

/// The key in a file; none if `path` is empty. Prints an error and returns the exit status if it
/// cannot be read.
[[nodiscard]] tl::expected<std::optional<link::Key>, int> key_of(const std::string& path);

/// Writes the bundle of a mission that is ready; returns 0 or, after printing an error, the exit
/// status.
[[nodiscard]] int write_bundle(Result& file, const CheckArguments& arguments,
                               const std::optional<link::Key>& key, const LoadedMission& loaded,
                               const CheckReport& report, const Diagnostics& diagnostics);

/// Loads a mission or a bundle to dive it, and says on stderr what was verified. Errors of a
/// bundle: BUNDLE-DAMAGED, BUNDLE-CONTENT, BUNDLE-VEHICLE, BUNDLE-PLAN, and those of the vehicle's
/// description; of a mission: those of load(). With `--unchecked` neither vehicle nor plans are
/// verified.
[[nodiscard]] std::optional<LoadedMission> load_dive(const RunArguments& arguments,
                                                     const std::optional<link::Key>& key,
                                                     Diagnostics& diagnostics);

/// What the supervisor of a dive needs of it.
struct SupervisedDive {
  Mission mission;
  planning::World world;  ///< As LoadedMission::world.
  MotionModel motion;     ///< Of the vehicle of `--vehicle`, else the bundle's, else the Aqua2.
};

/// Loads the mission or the bundle that a supervisor is given. Errors: those of load_dive() with
/// `--unchecked`.
[[nodiscard]] std::optional<SupervisedDive> load_supervised(const SuperviseArguments& arguments,
                                                            const std::optional<link::Key>& key,
                                                            Diagnostics& diagnostics);

/// The mission of a file or of a bundle, for commands that need neither map nor vehicle. Errors:
/// FILE-KIND, BUNDLE-DAMAGED, BUNDLE-CONTENT, and those of load_mission().
[[nodiscard]] std::optional<Mission> load_mission_or_bundle(const std::string& path,
                                                            Diagnostics& diagnostics);

}  // namespace dive::mission
