#pragma once
// How a study ends that cannot read what it is given.

#include <exception>
#include <iostream>

namespace dive::bench {

/// The exit status of a study: 2, with the reason on stderr, where `study` throws.
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
