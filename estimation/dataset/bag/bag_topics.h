#pragma once
// Which topics of a bag are a recording's sensors.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "estimation/dataset/bag/bag_file.h"
#include "estimation/dataset/bag/bag_recording.h"
#include "estimation/dataset/bag/calibration_file.h"

namespace dive::estimation {

/// Indices of a bag's topics.
struct SensorTopics {
  std::size_t imu = 0;
  std::vector<std::size_t> cameras;
  std::optional<std::size_t> depth;
  std::optional<std::size_t> velocity;
  std::optional<std::size_t> truth;
};

/// No two cameras have the same topic. The error is a clause and ends with the bag's topics.
[[nodiscard]] tl::expected<SensorTopics, std::string> choose_topics(
    std::span<const BagTopic> topics, const BagOptions& options,
    const CalibratedTopics& calibrated);

/// "/sonar (sonar_msgs/Ping, 12 messages)", separated by commas.
[[nodiscard]] std::string list_topics(std::span<const BagTopic> topics,
                                      std::span<const std::size_t> without);

}  // namespace dive::estimation
