#include "mission/record/log_digest.h"

#include <fmt/format.h>

namespace dive::mission {

std::string log_digest(const LogHeader& header) {
  Fnv1a64 digest;
  for (const std::string* file :
       {&header.mission_xml, &header.map_xml, &header.map_meshes, &header.vehicle_urdf}) {
    digest.add(*file);
    digest.add(std::string_view("\0", 1));
  }
  return fmt::format("{:016x}", digest.value());
}

}  // namespace dive::mission
