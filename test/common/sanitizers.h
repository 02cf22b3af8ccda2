#pragma once
// Skips tests that would take minutes under the sanitizers, in code that other tests run under them
// as well. All run in release.

namespace dive::testing {

#ifdef __SANITIZE_ADDRESS__
inline constexpr bool kUnderSanitizers = true;
#else
inline constexpr bool kUnderSanitizers = false;
#endif

}  // namespace dive::testing

#define DIVE_SKIP_UNDER_SANITIZERS(why)                           \
  do {                                                            \
    if (::dive::testing::kUnderSanitizers) GTEST_SKIP() << (why); \
  } while (false)
