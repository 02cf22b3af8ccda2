#pragma once
// The mathematics of the program: elementary functions (libm.cpp) and Eigen's arithmetic.

#include <string>

namespace dive {

/// Identifies the mathematics of this process, as "sleef-VERSION/HASH/ARCHITECTURE". The hash is of
/// the bits of a fixed set of results, computed once, so that another compiler option or library is
/// noticed. The architecture stands for the libraries, which are compiled for it.
[[nodiscard]] const std::string& mathematics();

}  // namespace dive
