#include "estimation/dataset/csv_table.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <istream>
#include <limits>
#include <optional>
#include <system_error>

#include <fmt/format.h>

#include "common/input_file.h"

namespace dive::estimation {
namespace {

constexpr std::size_t kMaxLine = 4096;  // bytes

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

template <typename Number>
bool parse(std::string_view field, Number& number) {
  const char* end = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), end, number);
  return !field.empty() && error == std::errc() && stop == end;
}

// Converts nanoseconds with rounding.
std::optional<Utime> to_utime(std::string_view field) {
  std::int64_t ns = 0;
  if (!parse(field, ns) || ns < 0 || ns > std::numeric_limits<std::int64_t>::max() - 500) {
    return std::nullopt;
  }
  return (ns + 500) / 1000;
}

}  // namespace

bool to_number(std::string_view field, double& number) {
  if (!field.empty() && field.front() == '+') field.remove_prefix(1);
  return parse(field, number) && std::isfinite(number);
}

std::string to_numbers(const CsvRow& row, std::size_t first, std::size_t n, double* numbers) {
  if (row.fields.size() < first + n) {
    return fmt::format("{} fields; at least {} are expected, the stamp included",
                       row.fields.size() + 1, first + n + 1);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::string_view field = row.fields[first + i];
    if (!to_number(field, numbers[i])) {
      return fmt::format("field {} is \"{}\", which is no finite number", first + i + 2, field);
    }
  }
  return {};
}

tl::expected<void, std::string> for_each_row(
    const std::string& path, const std::function<std::string(const CsvRow&)>& take) {
  const auto opened = open_input_stream(path);
  if (!opened) return tl::make_unexpected(fmt::format("{}: {}", path, opened.error()));
  std::istream& file = **opened;
  CsvRow row;
  std::optional<Utime> last;
  const auto fail = [&](const std::string& what) {
    return tl::make_unexpected(fmt::format("{}:{}: {}", path, row.line, what));
  };
  for (std::string line; std::getline(file, line);) {
    ++row.line;
    if (line.size() > kMaxLine) return fail("the line is too long");
    std::string_view rest = trimmed(line);
    if (rest.empty() || rest.front() == '#') continue;
    row.fields.clear();
    std::optional<std::string_view> stamp;
    for (bool more = true; more;) {
      const std::size_t comma = rest.find(',');
      more = comma != std::string_view::npos;
      const std::string_view field = trimmed(rest.substr(0, comma));
      if (more) rest.remove_prefix(comma + 1);
      if (stamp) {
        row.fields.push_back(field);
      } else {
        stamp = field;
      }
    }
    const auto utime = to_utime(*stamp);
    if (!utime) return fail(fmt::format("\"{}\" is no stamp in nanoseconds", *stamp));
    if (last && *utime <= *last) return fail("its stamp is not later than that of the line before");
    row.utime = *utime;
    last = utime;
    if (const std::string what = take(row); !what.empty()) return fail(what);
  }
  if (file.bad()) return tl::make_unexpected(fmt::format("{}: cannot be read", path));
  return {};
}

}  // namespace dive::estimation
