#include "mission/card/card_text.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

namespace dive::mission {

std::string clock_text(double seconds) {
  const long whole = std::lround(std::max(seconds, 0.0));
  const long minutes = whole / 60;
  if (minutes < 60) return fmt::format("{}:{:02}", minutes, whole % 60);
  return fmt::format("{}:{:02}:{:02}", minutes / 60, minutes % 60, whole % 60);
}

std::string list_text(const std::vector<std::string>& names, std::size_t most) {
  if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
  const std::span<const std::string> shown = std::span(names).first(most);
  return fmt::format("{} and {} more", fmt::join(shown, ", "), names.size() - most);
}

std::string cut_text(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t end = most;
  const auto continues = [&](std::size_t i) {  // the middle of a character of UTF-8
    return (static_cast<unsigned char>(text[i]) & 0xC0U) == 0x80U;
  };
  while (end > 0 && continues(end)) --end;
  return text.substr(0, end) + "\u2026";
}

}  // namespace dive::mission
