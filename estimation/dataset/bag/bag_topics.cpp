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
      const auto at = find(given->second);
      if (!at) return Failure(fmt::format("there is no topic {}", given->second) + all());
      if (!is_type(topics_[*at].type)) {
        return Failure(fmt::format("{} is of type {}, which {} cannot be", given->second,
                                   topics_[*at].type, role) +
                       all());
      }
      return at;
    }
    for (const std::string& name : preset) {
      if (const auto at = find(name); at && is_type(topics_[*at].type)) return at;
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

  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const {
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      if (topics_[i].name == name && topics_[i].messages > 0) return i;
    }
    return std::nullopt;
  }

  [[nodiscard]] std::string all() const {
    return fmt::format("; its topics: {}", list_topics(topics_, {}));
  }

 private:
  std::span<const BagTopic> topics_;
  const BagOptions& options_;
};

Found choose_camera(const Choice& choice, std::size_t index, const BagPreset& preset,
                    std::span<const std::string> calibrated) {
  const std::string role = fmt::format("cam{}", index);
  const TopicNames names = index < preset.cameras.size() ? preset.cameras[index] : TopicNames{};
  auto found = choice.named(role, is_image_type, names);
  if (!found || *found) return found;
  if (const auto at = choice.find(calibrated[index])) return at;
  const std::vector<std::size_t> images = choice.of_type(is_image_type);
  if (images.size() == calibrated.size()) return images[index];
  return Failure(fmt::format("{} topics of images for {} calibrated camera(s): choose with "
                             "--topic {}=NAME",
                             images.size(), calibrated.size(), role) +
                 choice.all());
}

// A sensor that a recording need not have: the only topic of its type.
Found choose_optional(const Choice& choice, const std::string& role, IsType is_type,
                      const TopicNames& preset) {
  auto found = choice.named(role, is_type, preset);
  if (!found || *found) return found;
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
                                                      std::span<const std::string> camera_topics) {
  const Choice choice(topics, options);
  const BagPreset* const known = find_preset(options.preset);
  const BagPreset preset = known != nullptr ? *known : BagPreset{};
  SensorTopics chosen;
  const auto imu = choose_optional(choice, "imu", is_imu_type, preset.imu);
  if (!imu) return Failure(imu.error());
  if (!*imu) {
    return Failure(fmt::format("{} topics of IMUs: choose with --topic imu=NAME",
                               choice.of_type(is_imu_type).size()) +
                   choice.all());
  }
  chosen.imu = **imu;
  for (std::size_t i = 0; i < camera_topics.size(); ++i) {
    const auto camera = choose_camera(choice, i, preset, camera_topics);
    if (!camera) return Failure(camera.error());
    chosen.cameras.push_back(**camera);
  }
  const auto depth = choose_optional(choice, "depth", is_pressure_type, preset.depth);
  if (!depth) return Failure(depth.error());
  chosen.depth = *depth;
  // Only by name: such a message may also be a command, or another estimator's result.
  const auto velocity = choice.named("velocity", is_velocity_type, {});
  if (!velocity) return Failure(velocity.error());
  chosen.velocity = *velocity;
  const auto truth = choose_optional(choice, "truth", is_pose_type, preset.truth);
  if (!truth) return Failure(truth.error());
  chosen.truth = *truth;
  return chosen;
}

}  // namespace dive::estimation
