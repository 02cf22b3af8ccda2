#pragma once
// The lifetime of a command, and the times that follow from it, us. The first three are also in
// vehicle_command_t.lcm, for drivers that do not use this library; link/codec.cpp compares them.

#include "common/clock.h"

namespace dive::vehicle {

/// Age of the last command from which on the vehicle stops.
inline constexpr Utime kCommandStale = 200'000;
/// Age from which on the vehicle brings itself home, and by default the supervisor holds it.
inline constexpr Utime kCommandTimeout = 1'000'000;
/// Silence of a session after which the commands of another one are obeyed.
inline constexpr Utime kSessionTimeout = 500'000;
/// Age of the supervisor's last command up to which the executive is not obeyed.
inline constexpr Utime kSupervised = 300'000;
/// Commands without a gap after which the supervisor gives the vehicle back.
inline constexpr Utime kRecovered = 300'000;

// What the executive assumes after a time without commands:

/// The supervisor may hold the vehicle: a little less than it takes.
inline constexpr Utime kHeldBySupervisor = kCommandTimeout - 200'000;
/// Time of commands after which the vehicle obeys them again, and some more.
inline constexpr Utime kGivenBack = kRecovered + kSupervised + 400'000;
/// Time after a checkpoint for which the vehicle swims on: the mean age of a checkpoint, of which
/// five a second are written, at the last command, and the life of that.
inline constexpr Utime kSwimsOn = 100'000 + kCommandStale;

}  // namespace dive::vehicle
