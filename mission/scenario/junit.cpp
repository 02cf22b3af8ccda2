#include "mission/scenario/junit.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

namespace dive::mission {
namespace {

// Number of bytes of the UTF-8 sequence at the start of `text` if XML 1.0 allows it; else 0.
std::size_t allowed_sequence(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return first >= 0x20 || first == '\n' || first == '\t' ? 1 : 0;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  std::uint32_t code = first & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
    code = (code << 6U) | (byte(i) & 0x3FU);
  }
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = code >= 0xD800 && code <= 0xDFFF;
  const bool is_none = code == 0xFFFE || code == 0xFFFF;
  return code < kSmallest[length] || code > 0x10FFFF || is_surrogate || is_none ? 0 : length;
}

std::string escaped(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = allowed_sequence(text);
    switch (length == 1 ? text.front() : '\0') {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\n':
        out += "&#10;";
        break;
      default:
        out += length == 0 ? "?" : text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

std::string to_xml(const TestCase& test) {
  std::string out = fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\"",
                                escaped(test.folder), escaped(test.name), test.seconds);
  if (test.failures.empty() && test.error.empty()) return out + "/>\n";
  out += ">\n";
  if (!test.error.empty()) {
    out += fmt::format("      <error message=\"{}\"/>\n", escaped(test.error));
  }
  if (!test.failures.empty()) {
    out +=
        fmt::format("      <failure message=\"{}\">{}</failure>\n", escaped(test.failures.front()),
                    escaped(fmt::format("{}", fmt::join(test.failures, "\n"))));
  }
  return out + "    </testcase>\n";
}

}  // namespace

std::string to_junit(const std::vector<TestCase>& cases) {
  const auto failed =
      std::ranges::count_if(cases, [](const TestCase& test) { return !test.failures.empty(); });
  const auto in_error =
      std::ranges::count_if(cases, [](const TestCase& test) { return !test.error.empty(); });
  double seconds = 0.0;
  for (const TestCase& test : cases) seconds += test.seconds;
  const std::string counts =
      fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\"", cases.size(),
                  failed, in_error, seconds);
  std::string out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  out += fmt::format("<testsuites name=\"dive test\" {}>\n  <testsuite name=\"scenarios\" {}>\n",
                     counts, counts);
  for (const TestCase& test : cases) out += to_xml(test);
  return out + "  </testsuite>\n</testsuites>\n";
}

}  // namespace dive::mission
