#pragma once
// A report as the JSON that its page draws. mission/report/page/data.js reads it.

#include <nlohmann/json_fwd.hpp>

#include "mission/report/report.h"

namespace dive::mission {

/// Numbers that are not finite are null; long lists are packed (packed.h).
[[nodiscard]] nlohmann::ordered_json page_data(const Report& report);

}  // namespace dive::mission
