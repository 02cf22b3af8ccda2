#include "estimation/dataset/csv_table.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <istream>
#include <limits>
#include <optional>
#include <system_error>

#include <fmt/format.h>

#include "common/input_file.h"
#include "common/source_text.h"

namespace dive::estimation {
namespace {

constexpr std::size_t kMaxLine = 4096;  // bytes

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

bool parse(std::string_view field, double& number) {
  if (!field.empty() && field.front() == '+') field.remove_prefix(1);
  const char* end = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), end, number);
  return !field.empty() && error == std::errc() && stop == end;
}

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

// Nanoseconds as an integer, exactly; with a fraction or an exponent, as some tools write them,
// rounded.
std::optional<std::int64_t> to_nanoseconds(std::string_view field) {
  std::int64_t ns = 0;
  const char* const end = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), end, ns);
  const std::string_view rest(stop, static_cast<std::size_t>(end - stop));
  if (error == std::errc() && rest.empty()) return ns;
  if (error == std::errc() && rest.front() == '.' &&
      std::all_of(rest.begin() + 1, rest.end(), is_digit)) {
    return ns + (rest.size() > 1 && rest[1] >= '5' ? 1 : 0);
  }
  double value = 0.0;
  if (!to_number(field, value) || !(std::abs(value) < 9e18)) return std::nullopt;
  return std::llround(value);
}

// Converts nanoseconds with rounding.
std::optional<Utime> to_utime(std::string_view field) {
  const std::optional<std::int64_t> ns = to_nanoseconds(field);
  if (!ns || *ns < 0 || *ns > std::numeric_limits<std::int64_t>::max() - 500) return std::nullopt;
  return (*ns + 500) / 1000;
}

// Splits a line at its commas; returns the first field.
std::string_view split(std::string_view line, std::vector<std::string_view>& fields) {
  const std::size_t first = line.find(',');
  const std::string_view stamp = trimmed(line.substr(0, first));
  fields.clear();
  for (std::size_t comma = first; comma != std::string_view::npos;) {
    line.remove_prefix(comma + 1);
    comma = line.find(',');
    fields.push_back(trimmed(line.substr(0, comma)));
  }
  return stamp;
}

class Table {
 public:
  explicit Table(const std::function<std::string(const CsvRow&)>& take) : take_(take) {}

  // Returns what is wrong with the line, if anything.
  std::string add(std::string_view line) {
    if (++row_.line == 1 && line.starts_with(kByteOrderMark)) {
      line.remove_prefix(kByteOrderMark.size());
    }
    line = trimmed(line);
    if (line.empty() || line.front() == '#') return {};
    const std::string_view stamp = split(line, row_.fields);
    const auto utime = to_utime(stamp);
    if (!utime) {
      const bool is_header = row_.line == 1 && !stamp.empty() && is_letter(stamp.front());
      return fmt::format("\"{}\" is not a stamp in nanoseconds{}", stamp,
                         is_header ? "; begin a header with #" : "");
    }
    if (last_ && *utime < *last_) {
      return fmt::format("its stamp {} is earlier than {} of the line before", stamp, last_stamp_);
    }
    ++rows_;
    if (last_ == utime) {
      if (ignored_.same_time++ == 0) ignored_.first_same_time = row_.line;
      return {};
    }
    row_.utime = *utime;
    std::string wrong = take_(row_);
    if (!wrong.empty()) return wrong;
    last_ = utime;
    last_stamp_ = stamp;
    return wrong;
  }

  void cut(std::string reason) {
    ignored_.cut_line = row_.line;
    ignored_.cut_reason = std::move(reason);
  }

  // Stamps in milliseconds or seconds fall into one microsecond if they are read as nanoseconds.
  [[nodiscard]] bool has_wrong_unit() const { return 2 * ignored_.same_time > rows_; }

  [[nodiscard]] std::uint32_t line() const { return row_.line; }
  [[nodiscard]] std::size_t rows() const { return rows_; }
  [[nodiscard]] const IgnoredRows& ignored() const { return ignored_; }

 private:
  const std::function<std::string(const CsvRow&)>& take_;
  CsvRow row_;
  std::size_t rows_ = 0;
  std::optional<Utime> last_;
  std::string last_stamp_;
  IgnoredRows ignored_;
};

}  // namespace

bool to_number(std::string_view field, double& number) {
  return parse(field, number) && std::isfinite(number);
}

std::string to_numbers(const CsvRow& row, std::size_t first, std::size_t n, double* numbers) {
  if (row.fields.size() < first + n) {
    return fmt::format("{} fields; at least {} are expected, the stamp included",
                       row.fields.size() + 1, first + n + 1);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::string_view field = row.fields[first + i];
    if (!parse(field, numbers[i])) {
      return fmt::format("field {} is \"{}\", which is not a number", first + i + 2, field);
    }
  }
  return {};
}

tl::expected<IgnoredRows, std::string> for_each_row(
    const std::string& path, const std::function<std::string(const CsvRow&)>& take) {
  const auto opened = open_input_stream(path);
  if (!opened) return tl::make_unexpected(fmt::format("{}: {}", path, opened.error()));
  std::istream& file = **opened;
  Table table(take);
  const auto fail = [&](std::uint32_t line, const std::string& what) {
    return tl::make_unexpected(fmt::format("{}:{}: {}", path, line, what));
  };
  std::array<char, kMaxLine + 2> line{};
  while (file.getline(line.data(), static_cast<std::streamsize>(line.size()))) {
    const bool is_cut = file.eof();  // no line break
    const auto size = static_cast<std::size_t>(file.gcount()) - (is_cut ? 0 : 1);
    const std::string wrong = table.add({line.data(), size});
    if (!wrong.empty() && !is_cut) return fail(table.line(), wrong);
    if (!wrong.empty()) table.cut(wrong);
  }
  if (file.bad()) return tl::make_unexpected(fmt::format("{}: cannot be read", path));
  if (!file.eof()) return fail(table.line() + 1, "the line is too long");
  if (table.has_wrong_unit()) {
    return fail(table.ignored().first_same_time,
                fmt::format("{} of {} stamps are less than a microsecond after the one before: are "
                            "they in nanoseconds?",
                            table.ignored().same_time, table.rows()));
  }
  return table.ignored();
}

}  // namespace dive::estimation
