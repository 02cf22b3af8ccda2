#pragma once
// The one place where latitudes, longitudes and magnetic headings of a mission become what the rest
// of the program knows: x and y in W, and true headings.

#include <optional>

#include "common/diagnostic.h"
#include "common/xml.h"
#include "mission/document/language.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// Requires a mission that has passed the schema, with its defaults. Afterwards every element whose
/// type has x and y has both; x and y computed from latitude and longitude are rounded to 1e-6 m
/// and have the span of the latitude and of the longitude. Where headings are magnetic, every
/// heading_deg and first_bearing_deg is turned by the declination. Elements are known by their
/// type's attributes, so that a new one needs nothing here. Returns <origin>. Codes: MIS-ORIGIN,
/// MIS-POSITION.
[[nodiscard]] std::optional<Origin> resolve_positions(XmlElement& mission, const SourceText& source,
                                                      const Language& language,
                                                      Diagnostics& diagnostics);

}  // namespace dive::mission
