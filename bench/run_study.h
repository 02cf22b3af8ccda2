#pragma once
// Error handling of a study whose input cannot be read.

#include <exception>
#include <iostream>

namespace dive::bench {

/// The exit status of a study: 2, with the reason on stderr, if `study` throws.
template <class Study>
[[nodiscard]] int run_study(Study&& study) {
  try {
    study();
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}

}  // namespace dive::bench
