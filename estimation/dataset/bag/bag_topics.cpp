#include "estimation/dataset/bag/bag_topics.h"

#include <algorithm>
#include <functional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "estimation/dataset/bag/bag_preset.h"
#include "estimation/dataset/bag/ros_message.h"

namespace dive::estimation {
namespace {

using Failure = tl::unexpected<std::string>;
using IsType = bool (*)(std::string_view);
using Found = tl::expected<std::optional<std::size_t>, std::string>;

bool is_imu_type(std::string_view type) { return type == "sensor_msgs/Imu"; }
bool is_pressure_type(std::string_view type) { return type == "sensor_msgs/FluidPressure"; }

class Choice {
 public:
  Choice(std::span<const BagTopic> topics, const BagOptions& options)
      : topics_(topics), options_(options) {}

  // The topic that the options or the preset name; empty if they name none.
  [[nodiscard]] Found named(const std::string& role, IsType is_type,
                            const TopicNames& preset) const {
    if (const auto given = options_.topics.find(role); given != options_.topics.end()) {
      const auto at = find(given->second, nullptr);
      if (!at) return Failure(fmt::format("there is no topic {}", given->second) + all());
      if (!is_type(topics_[*at].type)) {
        return Failure(fmt::format("{} is of type {}, which {} cannot be", given->second,
                                   topics_[*at].type, role) +
                       all());
      }
      return at;
    }
    for (const std::string& name : preset) {
      if (const auto at = find(name, is_type)) return at;
    }
    return std::nullopt;
  }

  [[nodiscard]] std::vector<std::size_t> of_type(IsType is_type) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      if (is_type(topics_[i].type) && topics_[i].messages > 0) found.push_back(i);
    }
    std::sort(found.begin(), found.end(),
              [&](std::size_t a, std::size_t b) { return topics_[a].name < topics_[b].name; });
    return found;
  }

  // The topic of that name with messages of that type, or of any if `is_type` is null.
  [[nodiscard]] std::optional<std::size_t> find(std::string_view name, IsType is_type) const {
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      if (topics_[i].name != name || topics_[i].messages == 0) continue;
      if (is_type == nullptr || is_type(topics_[i].type)) return i;
    }
    return std::nullopt;
  }

  [[nodiscard]] const std::string& name(std::size_t topic) const { return topics_[topic].name; }

  [[nodiscard]] std::string all() const {
    return fmt::format("; its topics: {}", list_topics(topics_, {}));
  }

 private:
  std::span<const BagTopic> topics_;
  const BagOptions& options_;
};

// The topic that is named for a camera; empty if there is none, or if the calibration's has no
// images.
Found named_camera(const Choice& choice, std::size_t index, const BagPreset& preset,
                   std::string_view calibrated) {
  const TopicNames names = index < preset.cameras.size() ? preset.cameras[index] : TopicNames{};
  auto found = choice.named(fmt::format("cam{}", index), is_image_type, names);
  if (!found || *found) return found;
  return choice.find(calibrated, is_image_type);
}

// One topic of images for each calibrated camera: those that are named, then the others in the
// order of their names, if there are as many as cameras without one.
tl::expected<std::vector<std::size_t>, std::string> choose_cameras(
    const Choice& choice, const BagPreset& preset, std::span<const std::string> calibrated) {
  std::vector<std::optional<std::size_t>> named;
  for (std::size_t i = 0; i < calibrated.size(); ++i) {
    const auto found = named_camera(choice, i, preset, calibrated[i]);
    if (!found) return Failure(found.error());
    const auto same = std::find(named.begin(), named.end(), *found);
    if (*found && same != named.end()) {
      return Failure(fmt::format("cam{} and cam{} are both {}: choose with --topic cam{}=NAME",
                                 same - named.begin(), i, choice.name(**found), i) +
                     choice.all());
    }
    named.push_back(*found);
  }
  std::vector<std::size_t> images = choice.of_type(is_image_type);
  const std::size_t of_all = images.size();
  std::erase_if(images, [&](std::size_t topic) {
    return std::find(named.begin(), named.end(), topic) != named.end();
  });
  const auto unnamed = std::find(named.begin(), named.end(), std::nullopt);
  const auto missing = std::count(named.begin(), named.end(), std::nullopt);
  if (missing > 0 && static_cast<std::size_t>(missing) != images.size()) {
    return Failure(fmt::format("{} topics of images for {} calibrated camera(s): choose with "
                               "--topic cam{}=NAME",
                               of_all, calibrated.size(), unnamed - named.begin()) +
                   choice.all());
  }
  std::vector<std::size_t> chosen;
  auto next = images.begin();
  for (const std::optional<std::size_t>& topic : named) chosen.push_back(topic ? *topic : *next++);
  return chosen;
}

// The topic that is named for a sensor, else the only one of its type; empty if there is none.
Found choose_sensor(const Choice& choice, const std::string& role, IsType is_type,
                    const TopicNames& preset, std::string_view calibrated) {
  auto found = choice.named(role, is_type, preset);
  if (!found || *found) return found;
  if (const auto at = choice.find(calibrated, is_type)) return at;
  const std::vector<std::size_t> candidates = choice.of_type(is_type);
  if (candidates.size() == 1) return candidates.front();
  return std::nullopt;
}

}  // namespace

std::string list_topics(std::span<const BagTopic> topics, std::span<const std::size_t> without) {
  std::string text;
  for (std::size_t i = 0; i < topics.size(); ++i) {
    if (std::find(without.begin(), without.end(), i) != without.end()) continue;
    text += fmt::format("{}{} ({}, {} messages)", text.empty() ? "" : ", ", topics[i].name,
                        topics[i].type, topics[i].messages);
  }
  return text.empty() ? "none" : text;
}

tl::expected<SensorTopics, std::string> choose_topics(std::span<const BagTopic> topics,
                                                      const BagOptions& options,
                                                      const CalibratedTopics& calibrated) {
  const Choice choice(topics, options);
  const BagPreset* const known = find_preset(options.preset);
  const BagPreset preset = known != nullptr ? *known : BagPreset{};
  SensorTopics chosen;
  const auto imu = choose_sensor(choice, "imu", is_imu_type, preset.imu, calibrated.imu);
  if (!imu) return Failure(imu.error());
  if (!*imu) {
    return Failure(fmt::format("{} topics of IMUs: choose with --topic imu=NAME",
                               choice.of_type(is_imu_type).size()) +
                   choice.all());
  }
  chosen.imu = **imu;
  auto cameras = choose_cameras(choice, preset, calibrated.cameras);
  if (!cameras) return Failure(cameras.error());
  chosen.cameras = std::move(*cameras);
  const auto depth = choose_sensor(choice, "depth", is_pressure_type, preset.depth, "");
  if (!depth) return Failure(depth.error());
  chosen.depth = *depth;
  // Only by name: such a message may also be a command, or another estimator's result.
  const auto velocity = choice.named("velocity", is_velocity_type, {});
  if (!velocity) return Failure(velocity.error());
  chosen.velocity = *velocity;
  const auto truth = choice.named("truth", is_pose_type, preset.truth);
  if (!truth) return Failure(truth.error());
  chosen.truth = *truth;
  return chosen;
}

}  // namespace dive::estimation
