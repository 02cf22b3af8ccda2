#include "mission/record/unfinished_dive.h"

#include <fmt/format.h>

#include "behaviors/failsafes.h"

namespace dive::mission {

std::string UnfinishedDive::cause() const {
  std::string cause = fmt::format("still in state {} after {:.0f} s", state, duration_s);
  if (!is_held) return cause;
  cause += fmt::format(", the last {:.0f} s in one place", rest_s);
  return why.empty() ? cause : cause + fmt::format(" ({})", why);
}

bool is_kept(const Status& status) {
  using behaviors::Rung;
  return status.rung != behaviors::to_string(Rung::kNone) &&
         status.rung != behaviors::to_string(Rung::kWarn);
}

}  // namespace dive::mission
