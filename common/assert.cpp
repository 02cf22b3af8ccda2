#include "common/assert.h"

#include <fmt/format.h>

namespace dive {

void assertion_failed(const char* condition, const char* file, int line) {
  throw AssertionFailure(
      fmt::format("{}:{}: internal error: {} does not hold", file, line, condition));
}

}  // namespace dive
