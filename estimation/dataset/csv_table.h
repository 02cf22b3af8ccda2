#pragma once
// Tables of a data.csv in the ASL format: a stamp in nanoseconds, then fields, separated by commas.
// Lines that begin with # and empty ones are passed over.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"

namespace dive::estimation {

struct CsvRow {
  std::size_t line = 0;  ///< From 1.
  Utime utime = 0;
  std::vector<std::string_view> fields;  ///< After the stamp, blanks trimmed.
};

/// Calls `take` for each row; it returns what is wrong with it, or an empty string. Stamps must
/// rise. An error is "FILE:LINE: what".
[[nodiscard]] tl::expected<void, std::string> for_each_row(
    const std::string& path, const std::function<std::string(const CsvRow&)>& take);

/// The whole field as a finite number.
[[nodiscard]] bool to_number(std::string_view field, double& number);

/// Fields [first, first + n) as finite numbers, or what is wrong.
[[nodiscard]] std::string to_numbers(const CsvRow& row, std::size_t first, std::size_t n,
                                     double* numbers);

}  // namespace dive::estimation
