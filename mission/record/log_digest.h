#pragma once
// The identification of a log header's files in the journal.

#include <string>

#include "common/fnv.h"
#include "mission/record/log.h"

namespace dive::mission {

/// FNV-1a 64 of the four files in a header, each followed by a zero byte, as 16 hex digits.
[[nodiscard]] std::string log_digest(const LogHeader& header);

}  // namespace dive::mission
