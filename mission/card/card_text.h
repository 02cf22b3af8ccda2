#pragma once
// Numbers and names as a dive card shows them.

#include <string>
#include <vector>

namespace dive::mission {

/// "9:06" or "1:09:06", rounded to a second.
[[nodiscard]] std::string clock_text(double seconds);

/// "a, b, c", or "a, b and 4 more" if there are more than `most` >= 1 names.
[[nodiscard]] std::string list_text(const std::vector<std::string>& names, std::size_t most);

/// The first `most` bytes or fewer, cut between characters, with an ellipsis if it was longer.
[[nodiscard]] std::string cut_text(const std::string& text, std::size_t most);

}  // namespace dive::mission
