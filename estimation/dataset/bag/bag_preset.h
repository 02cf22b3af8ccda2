#pragma once
// The topics of published data sets.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dive::estimation {

/// What a sensor's topics may be called, the first that a file has is used.
using TopicNames = std::vector<std::string>;

struct BagPreset {
  std::string name;
  std::string data;  ///< The data set, for messages.
  TopicNames imu;
  std::vector<TopicNames> cameras;  ///< Left, right.
  TopicNames depth;                 ///< Pressure.
  TopicNames truth;
  double density = 1025.0;  ///< Of the water, kg/m^3.
  bool is_tested = false;   ///< True when it was run on files of that data set.
};

[[nodiscard]] std::span<const BagPreset> bag_presets();
/// Null if there is none of that name.
[[nodiscard]] const BagPreset* find_preset(std::string_view name);

}  // namespace dive::estimation
