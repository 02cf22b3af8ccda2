#pragma once
// Tables of a data.csv in the ASL format: a stamp in nanoseconds, then fields, separated by commas.
// Empty lines, those that begin with #, and UTF-8's byte order mark are ignored.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"

namespace dive::estimation {

struct CsvRow {
  std::uint32_t line = 0;  ///< Line number from 1.
  Utime utime = 0;
  std::vector<std::string_view> fields;  ///< Fields after the stamp, blanks trimmed.
};

/// What was ignored in a table.
struct IgnoredRows {
  std::size_t same_time = 0;          ///< Rows whose time, in microseconds, is that of another.
  std::uint32_t first_same_time = 0;  ///< Line of the first one.
  std::uint32_t cut_line = 0;         ///< The last line if it ends in the middle; 0 if it does not.
  std::string cut_reason;             ///< What is wrong with it.
};

/// Calls `take` for each row; it returns an error, or an empty string. Stamps must not decrease.
/// Of rows of the same microsecond only the first is used. A last line that is wrong and has no
/// line break is ignored: its writer was stopped. An error is "FILE:LINE: what".
[[nodiscard]] tl::expected<IgnoredRows, std::string> for_each_row(
    const std::string& path, const std::function<std::string(const CsvRow&)>& take);

/// Parses the whole field as a finite number.
[[nodiscard]] bool to_number(std::string_view field, double& number);

/// Parses fields [first, first + n) as numbers, which may be NaN; returns the error, if any.
[[nodiscard]] std::string to_numbers(const CsvRow& row, std::size_t first, std::size_t n,
                                     double* numbers);

}  // namespace dive::estimation
