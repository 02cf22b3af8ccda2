#pragma once
// Skips tests that take minutes each, unless the environment has DIVE_LONG_TESTS, which
// ./check.sh --long sets.

#include <cstdlib>

#define DIVE_SKIP_LONG_TEST()                                                  \
  do {                                                                         \
    if (std::getenv("DIVE_LONG_TESTS") == nullptr) {                           \
      GTEST_SKIP() << "takes minutes: ./check.sh --long or DIVE_LONG_TESTS=1"; \
    }                                                                          \
  } while (false)
