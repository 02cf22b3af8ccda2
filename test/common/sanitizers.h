#pragma once
// What the sanitizers leave out: tests that would take minutes under them, in code that other tests
// bring under them too. All run in release.

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
