#pragma once

#include "mission/card/card.h"

namespace dive::mission {

inline constexpr std::size_t kMaxReactionRows = 8;  ///< Rows of a card that are states.
inline constexpr std::size_t kMaxCardWarnings = 3;
inline constexpr std::size_t kMaxWarningBytes = 190;
inline constexpr std::size_t kMaxDescriptionBytes = 150;
inline constexpr std::size_t kMaxNameBytes = 40;

/// The largest type, in points from 8 to 12, with which the card is expected to fit its page. An
/// estimate from the lengths of its texts: the browser chooses the font.
[[nodiscard]] double type_size(const CardSource& source);

}  // namespace dive::mission
