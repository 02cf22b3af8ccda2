#pragma once
// Summary of the dives of one mission.

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace dive::bench {

/// Prints outcomes, clearances and errors of position. `results` has an object for each dive, as
/// mission_dives.cpp writes it.
void print_summary(const std::string& name, std::vector<nlohmann::json> results);

}  // namespace dive::bench
