#pragma once
// The page of a report: one HTML file that needs no other file and no network.

#include <string>

#include "mission/report/report.h"

namespace dive::mission {

/// The page with its style, its scripts, three.js and D3 (embedded when this program was built) and
/// the report's data. Its content security policy forbids every request.
[[nodiscard]] std::string render_page(const Report& report);

}  // namespace dive::mission
