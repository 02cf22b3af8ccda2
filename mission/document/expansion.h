#pragma once
// Reuse: an <include> stands for the content of a fragment, ${name} in a value for a parameter.
//
//   <include href="parts/row.xml"><with name="x" value="4"/></include>
//
//   <fragment xmlns="urn:dive:mission:1">
//     <parameters><parameter name="x"/><parameter name="z" value="3"/></parameters>
//     <goto id="row-${x}" x="${x}" y="0" z="${z}" z_units="DEPTH"> ... </goto>
//   </fragment>
//
// What comes out is one document whose every line knows where it was written: that is what is
// judged, run and logged, and a dive needs nothing else.

#include <optional>

#include "common/diagnostic.h"
#include "common/xml.h"

namespace dive::mission {

struct ExpansionLimits {
  int max_includes = 200;  ///< In all, so that few lines cannot stand for millions.
  int max_depth = 8;       ///< Fragments in fragments.
};

/// The document with everything filled in; itself where there is nothing to. `limits` are those of
/// the result. A href is relative to the file it stands in and must lie beneath the folder of the
/// document, symbolic links followed. Errors: MIS-INCLUDE, MIS-PARAMETER, XML-* and
/// FILE-UNREADABLE of fragments.
[[nodiscard]] std::optional<XmlDocument> expand(XmlDocument document, const XmlLimits& limits,
                                                const ExpansionLimits& expansion,
                                                Diagnostics& diagnostics);

}  // namespace dive::mission
