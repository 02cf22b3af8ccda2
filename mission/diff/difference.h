#pragma once

#include <string>

namespace dive::mission {

/// One thing that two files state differently.
struct Difference {
  std::string what;  ///< "limits/@clearance"
  std::string a;     ///< Value in the first file; empty: it is not there.
  std::string b;
};

}  // namespace dive::mission
