#pragma once
// Expansion: an <include> is replaced by the content of a fragment, ${name} in a value by a
// parameter, and the tide table of a <current table="FILE.csv"> by its samples.
//
//   <include href="parts/row.xml"><with name="x" value="4"/></include>
//
//   <fragment xmlns="urn:dive:mission:1">
//     <parameters><parameter name="x"/><parameter name="z" value="3"/></parameters>
//     <goto id="row-${x}" x="${x}" y="0" z="${z}" z_units="DEPTH"> ... </goto>
//   </fragment>
//
// The result is one document, each line with its original file and position. It is what is checked,
// executed and logged, and a dive needs no other file.

#include <optional>

#include "common/diagnostic.h"
#include "common/xml.h"

namespace dive::mission {

struct ExpansionLimits {
  int max_includes = 200;  ///< Total, so that a few lines cannot expand to millions.
  int max_depth = 8;       ///< Nesting depth of fragments.
};

/// The expanded document; the document itself if there is nothing to expand. `limits` apply to the
/// result. A href or a table is relative to the file that contains it and, with symbolic links
/// resolved, must lie beneath the folder of the document. Errors: MIS-INCLUDE, MIS-PARAMETER,
/// MIS-CURRENT-TABLE, XML-* and FILE-UNREADABLE of fragments.
[[nodiscard]] std::optional<XmlDocument> expand(XmlDocument document, const XmlLimits& limits,
                                                const ExpansionLimits& expansion,
                                                Diagnostics& diagnostics);

}  // namespace dive::mission
