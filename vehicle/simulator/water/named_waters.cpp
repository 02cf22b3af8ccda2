#include "vehicle/simulator/water/named_waters.h"

#include <algorithm>
#include <array>

namespace dive::vehicle {
namespace {

struct NamedWater {
  const char* name;
  WaterOptics (*optics)();
};
constexpr std::array<NamedWater, 4> kWaters{{
    {"clear_pool", clear_pool},
    {"coastal_sea", coastal_sea},
    {"green_lake", green_lake},
    {"dark_wreck", dark_wreck},
}};

}  // namespace

const std::vector<std::string>& water_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const NamedWater& water : kWaters) result.emplace_back(water.name);
    return result;
  }();
  return names;
}

std::optional<StereoCameraOptions> stereo_camera_in(const std::string& water) {
  const auto* const found = std::find_if(kWaters.begin(), kWaters.end(),
                                         [&](const NamedWater& w) { return water == w.name; });
  if (found == kWaters.end()) return std::nullopt;
  StereoCameraOptions options;
  options.water = found->optics();
  if ((options.water.daylight == 0.0).all()) options.lamps = bow_lamps();
  return options;
}

}  // namespace dive::vehicle
