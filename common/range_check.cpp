#include "common/range_check.h"

#include <fmt/format.h>

namespace dive {

void RangeCheck::operator()(const char* name, double value, double low, double high) {
  if (!problem_.empty() || (value >= low && value <= high)) return;  // false for NaN
  problem_ = fmt::format("{} is {} but must be from {} to {}", name, value, low, high);
}

}  // namespace dive
