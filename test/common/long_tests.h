#pragma once
// Skips tests that take minutes each, unless the environment has DIVE_LONG_TESTS: ./check.sh --ci
// sets it, ./check.sh does not.

#include <cstdlib>

#define DIVE_SKIP_LONG_TEST()                                                \
  do {                                                                       \
    if (std::getenv("DIVE_LONG_TESTS") == nullptr) {                         \
      GTEST_SKIP() << "takes minutes: ./check.sh --ci or DIVE_LONG_TESTS=1"; \
    }                                                                        \
  } while (false)
