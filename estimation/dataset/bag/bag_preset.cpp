#include "estimation/dataset/bag/bag_preset.h"

#include <algorithm>

namespace dive::estimation {
namespace {

constexpr double kFreshWater = 1000.0;  // kg/m^3
constexpr double kSeaWater = 1025.0;

std::vector<BagPreset> make_presets() {
  return {{"euroc",
           "EuRoC MAV",
           {"/imu0"},
           {{"/cam0/image_raw"}, {"/cam1/image_raw"}},
           {},
           {"/vicon/firefly_sbx/firefly_sbx", "/leica/position"},
           kFreshWater,
           false},
          {"tum-vi",
           "TUM VI",
           {"/imu0"},
           {{"/cam0/image_raw"}, {"/cam1/image_raw"}},
           {},
           {"/vrpn_client/raw_transform"},
           kFreshWater,
           false},
          {"aqualoc",
           "AQUALOC",
           {"/rtimulib_node/imu"},
           {{"/camera/image_raw"}},
           {"/barometer_node/pressure"},
           {},
           kSeaWater,
           false},
          {"ntnu-underwater",
           "the multi-camera underwater data set of NTNU",
           {"/alphasense_driver_ros/imu"},
           {{"/alphasense_driver_ros/cam0"}, {"/alphasense_driver_ros/cam1"}},
           {"/mavros/imu/static_pressure"},
           {"/qualisys/ariel/pose"},
           kFreshWater,
           false},
          {"afrl",
           "the underwater data sets of AFRL",
           {"/imu/imu"},
           {{"/slave1/image_raw/compressed", "/cam_fl/image_raw/compressed"},
            {"/slave2/image_raw/compressed", "/cam_fr/image_raw/compressed"}},
           {},
           {},
           kSeaWater,
           false}};
}

}  // namespace

std::span<const BagPreset> bag_presets() {
  static const std::vector<BagPreset> presets = make_presets();
  return presets;
}

const BagPreset* find_preset(std::string_view name) {
  const auto presets = bag_presets();
  const auto at = std::find_if(presets.begin(), presets.end(),
                               [&](const BagPreset& preset) { return preset.name == name; });
  return at == presets.end() ? nullptr : &*at;
}

}  // namespace dive::estimation
