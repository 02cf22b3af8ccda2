#pragma once
// Tables of a data.csv in the ASL format: a stamp in nanoseconds, then fields, separated by commas.
// Empty lines and those that begin with # are ignored.

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

/// Calls `take` for each row; it returns an error, or an empty string. Stamps must increase. An
/// error is "FILE:LINE: what".
[[nodiscard]] tl::expected<void, std::string> for_each_row(
    const std::string& path, const std::function<std::string(const CsvRow&)>& take);

/// Parses the whole field as a finite number.
[[nodiscard]] bool to_number(std::string_view field, double& number);

/// Parses fields [first, first + n) as finite numbers; returns the error, if any.
[[nodiscard]] std::string to_numbers(const CsvRow& row, std::size_t first, std::size_t n,
                                     double* numbers);

}  // namespace dive::estimation
