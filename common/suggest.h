#pragma once
// "Did you mean ...?"

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace dive {

/// The candidate nearest to `word` by edit distance (insert, delete, replace, swap neighbours), if
/// it is near enough to be a likely typo: at most a third of the word's length, or 1 if that is
/// more.
[[nodiscard]] std::optional<std::string> closest_match(std::string_view word,
                                                       std::span<const std::string> candidates);

/// "did you mean 'goto'?" with that candidate; empty if there is none.
[[nodiscard]] std::string did_you_mean(std::string_view word,
                                       std::span<const std::string> candidates);

}  // namespace dive
