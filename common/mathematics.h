#pragma once
// The mathematics of the program: elementary functions (libm.cpp) and Eigen's arithmetic.

#include <string>

namespace dive {

/// Identifies the mathematics of this process, as "sleef-VERSION/HASH". The hash is of the bits of
/// a fixed set of results, computed once: two processes with the same identifier compute the same
/// from the same inputs, whatever their CPUs, compilers and libraries.
[[nodiscard]] const std::string& mathematics();

}  // namespace dive
