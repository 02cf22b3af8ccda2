#pragma once
// Environments by others, for studies: a wreck's hull, a cave and a dock, from the shared data.

#include <string>
#include <vector>

namespace dive::bench {

/// Writes a mission in an unknown environment for each of them into a folder of its own, and
/// returns the missions' paths. `data` is the folder of the shared data. Throws if one is missing.
[[nodiscard]] std::vector<std::string> write_real_waters(const std::string& data);

}  // namespace dive::bench
