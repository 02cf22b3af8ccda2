#include "estimation/dataset/bag/bag_recording.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "estimation/dataset/bag/bag_file.h"
#include "estimation/dataset/bag/bag_preset.h"
#include "estimation/dataset/bag/bag_topics.h"
#include "estimation/dataset/bag/calibration_file.h"
#include "estimation/dataset/bag/ros_message.h"
#include "estimation/dataset/sample_screen.h"

namespace dive::estimation {
namespace {

using Failure = tl::unexpected<std::string>;

constexpr double kSurface_pa = 101'325.0;  // standard atmosphere
constexpr double kGravity = 9.81;          // m/s^2
constexpr double kPascalPerHectopascal = 100.0;
constexpr double kMinPascal = 50'000.0;  // the median of a pressure in Pa, at the surface or below
constexpr double kMinHectopascal = 500.0;  // likewise in hPa

// Orders samples by time, and removes all but the first of each time, with a warning.
template <typename Sample>
void put_in_order(std::vector<Sample>& samples, SampleOrigin& origin, Diagnostics& diagnostics) {
  std::vector<std::size_t> order(samples.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return samples[a].utime < samples[b].utime;
  });
  std::vector<Sample> sorted;
  std::vector<std::uint32_t> lines;
  std::optional<std::size_t> again;
  for (const std::size_t i : order) {
    if (!sorted.empty() && sorted.back().utime == samples[i].utime) {
      if (!again) again = i;
      continue;
    }
    sorted.push_back(std::move(samples[i]));
    lines.push_back(origin.lines[i]);
  }
  if (again) {
    diagnostics.add(origin.at(*again, Severity::kWarning, "SAME-TIME",
                              fmt::format("{} of {} messages have the stamp of another; they are "
                                          "ignored",
                                          samples.size() - sorted.size(), samples.size()),
                              ""));
  }
  samples = std::move(sorted);
  origin.lines = std::move(lines);
}

// Reads the messages of the chosen topics into a recording.
class BagReading {
 public:
  BagReading(std::shared_ptr<BagFile> bag, SensorTopics topics, Calibration calibration)
      : bag_(std::move(bag)),
        topics_(std::move(topics)),
        recording_(std::move(calibration.sensors)) {
    recording_.source = bag_->path();
    numbers_.resize(bag_->topics().size());
    recording_.imu_origin.file = place(topics_.imu);
    if (topics_.depth) recording_.depth_origin.file = place(*topics_.depth);
    if (topics_.velocity) recording_.velocity_origin.file = place(*topics_.velocity);
    if (topics_.truth) {
      recording_.truth_origin.file = place(*topics_.truth);
      recording_.has_true_attitude = has_attitude(bag_->topics()[*topics_.truth].type);
    }
    for (std::size_t i = 0; i < topics_.cameras.size(); ++i) {
      recording_.cameras[i].images_origin.file = place(topics_.cameras[i]);
      wide_bits_.push_back(std::make_shared<int>(16));
    }
  }

  tl::expected<Recording, std::string> run(double density) {
    for (const BagMessage& message : bag_->messages()) {
      const std::uint32_t number = ++numbers_[message.topic];
      const std::string wrong = take(message, number);
      if (wrong.empty()) continue;
      return Failure(fmt::format("{}, message {}: {}", place(message.topic), number, wrong));
    }
    for (std::size_t i = 0; i < topics_.cameras.size(); ++i) find_wide_bits(i);
    Diagnostics& diagnostics = recording_.diagnostics;
    put_in_order(recording_.imu, recording_.imu_origin, diagnostics);
    put_in_order(recording_.velocity, recording_.velocity_origin, diagnostics);
    put_in_order(recording_.truth, recording_.truth_origin, diagnostics);
    for (RecordedCamera& camera : recording_.cameras) {
      put_in_order(camera.images, camera.images_origin, diagnostics);
    }
    if (topics_.depth) {
      put_in_order(pressures_, recording_.depth_origin, diagnostics);
      convert_pressures(density);
    }
    return std::move(recording_);
  }

 private:
  [[nodiscard]] std::string place(std::size_t topic) const {
    return fmt::format("{} {}", bag_->path(), bag_->topics()[topic].name);
  }

  // Returns what is wrong with the message, if anything.
  std::string take(const BagMessage& message, std::uint32_t number) {
    std::string wrong = read(message, number);
    if (wrong.empty()) return wrong;
    const auto bytes = bag_->read(message);
    if (!bytes || !is_zstd(*bytes)) return wrong;
    return "the message is compressed by zstd; decompress the bag's messages with ros2 bag convert";
  }

  std::string read(const BagMessage& message, std::uint32_t number) {
    const std::size_t topic = message.topic;
    const BagTopic& about = bag_->topics()[topic];
    const auto camera = std::find(topics_.cameras.begin(), topics_.cameras.end(), topic);
    const bool is_imu = topic == topics_.imu;
    const bool is_depth = topics_.depth && topic == *topics_.depth;
    const bool is_truth = topics_.truth && topic == *topics_.truth;
    const bool is_velocity = topics_.velocity && topic == *topics_.velocity;
    if (!is_imu && !is_depth && !is_velocity && !is_truth && camera == topics_.cameras.end())
      return {};
    const auto bytes = bag_->read(message);
    if (!bytes) return bytes.error();
    const Serialization kind = about.serialization;
    if (camera != topics_.cameras.end()) {
      const auto index = static_cast<std::size_t>(camera - topics_.cameras.begin());
      return take_image(message, number, *bytes, index);
    }
    if (is_imu) return add(decode_imu(*bytes, kind), recording_.imu, recording_.imu_origin, number);
    if (is_depth) {
      return add(decode_pressure(*bytes, kind), pressures_, recording_.depth_origin, number);
    }
    if (is_velocity) {
      return add(decode_velocity(*bytes, kind), recording_.velocity, recording_.velocity_origin,
                 number);
    }
    return add(decode_pose(*bytes, about.type, kind), recording_.truth, recording_.truth_origin,
               number);
  }

  template <typename Sample>
  static std::string add(const tl::expected<Sample, std::string>& sample,
                         std::vector<Sample>& samples, SampleOrigin& origin, std::uint32_t number) {
    if (!sample) return sample.error();
    samples.push_back(*sample);
    origin.lines.push_back(number);
    return {};
  }

  std::string take_image(const BagMessage& message, std::uint32_t number, Bytes bytes,
                         std::size_t index) {
    const BagTopic& topic = bag_->topics()[message.topic];
    const auto stamp = decode_stamp(bytes, topic.serialization);
    if (!stamp) return stamp.error();
    RecordedImage image;
    image.utime = *stamp + from_seconds(recording_.cameras[index].time_shift_s);
    image.path = fmt::format("{}, message {}", place(message.topic), number);
    image.read = [bag = bag_, message, type = topic.type, kind = topic.serialization,
                  bits = wide_bits_[index]]() -> tl::expected<ImageFrame, std::string> {
      const auto read = bag->read(message);
      if (!read) return Failure(read.error());
      return decode_image(*read, type, kind, *bits);
    };
    recording_.cameras[index].images.push_back(std::move(image));
    recording_.cameras[index].images_origin.lines.push_back(number);
    return {};
  }

  // Cameras of 10, 12 or 14 bits write them into 16. Nine images, because some are dark.
  void find_wide_bits(std::size_t camera) {
    constexpr std::size_t kImages = 9;
    const std::size_t topic = topics_.cameras[camera];
    std::vector<BagMessage> messages;
    for (const BagMessage& message : bag_->messages()) {
      if (message.topic == topic) messages.push_back(message);
    }
    const BagTopic& about = bag_->topics()[topic];
    int used = 0;
    for (std::size_t i = 0; i < kImages; ++i) {
      const auto bytes = bag_->read(messages[i * (messages.size() - 1) / (kImages - 1)]);
      if (bytes) used = std::max(used, used_bits(*bytes, about.type, about.serialization));
    }
    if (used == 0 || used > 14) return;
    *wide_bits_[camera] = std::max(10, used + used % 2);
    recording_.diagnostics.add(recording_.cameras[camera].images_origin.of_all(
        Severity::kNote, "IMAGE-BITS",
        fmt::format("its images of 16 bits use {} of them and are read as such",
                    *wide_bits_[camera]),
        ""));
  }

  // Hydrostatics. The unit is Pa by the message's definition, but some drivers give hPa.
  void convert_pressures(double density) {
    if (pressures_.empty()) return;
    std::vector<double> values;
    for (const PressureSample& sample : pressures_) {
      if (std::isfinite(sample.pressure)) values.push_back(sample.pressure);
    }
    if (values.empty()) values.push_back(kSurface_pa);  // every sample will be refused
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    const SampleOrigin& origin = recording_.depth_origin;
    double unit = 1.0;
    if (*middle < kMinHectopascal) {
      recording_.diagnostics.add(origin.of_all(
          Severity::kWarning, "PRESSURE",
          fmt::format("the median pressure is {:g}, neither in Pa nor in hPa: depth is not used",
                      *middle),
          ""));
      recording_.depth_origin = {};
      return;
    }
    if (*middle < kMinPascal) {
      unit = kPascalPerHectopascal;
      recording_.diagnostics.add(origin.of_all(
          Severity::kWarning, "PRESSURE",
          fmt::format("the median pressure is {:g}: it is taken as in hPa, not in Pa", *middle),
          ""));
    }
    for (const PressureSample& sample : pressures_) {
      const double depth_m = (unit * sample.pressure - kSurface_pa) / (density * kGravity);
      recording_.depth.push_back({sample.utime, depth_m});
    }
  }

  std::shared_ptr<BagFile> bag_;
  SensorTopics topics_;
  Recording recording_;
  std::vector<std::shared_ptr<int>> wide_bits_;  // of each camera's images with 16 bits
  std::vector<std::uint32_t> numbers_;           // of messages of each topic until now
  std::vector<PressureSample> pressures_;
};

void add_notes(const BagFile& bag, const SensorTopics& chosen, const BagPreset* preset,
               Diagnostics& diagnostics) {
  SampleOrigin whole;
  whole.file = bag.path();
  for (const std::string& warning : bag.warnings()) {
    diagnostics.add(whole.of_all(Severity::kWarning, "BAG", warning, ""));
  }
  if (preset != nullptr && !preset->is_tested) {
    diagnostics.add(whole.of_all(
        Severity::kWarning, "PRESET",
        fmt::format("preset {} is untested: it was never run on {}", preset->name, preset->data),
        "compare the topics and units with the documentation of the data"));
  }
  std::vector<std::size_t> used = chosen.cameras;
  used.push_back(chosen.imu);
  if (chosen.depth) used.push_back(*chosen.depth);
  if (chosen.velocity) used.push_back(*chosen.velocity);
  if (chosen.truth) used.push_back(*chosen.truth);
  const bool has_poses = std::any_of(bag.topics().begin(), bag.topics().end(),
                                     [](const auto& topic) { return is_pose_type(topic.type); });
  if (used.size() < bag.topics().size()) {
    diagnostics.add(whole.of_all(
        Severity::kNote, "TOPICS", "not used: " + list_topics(bag.topics(), used),
        has_poses && !chosen.truth ? "if one of them is the ground truth: --topic truth=NAME"
                                   : ""));
  }
  if (chosen.truth) {
    diagnostics.add(whole.of_all(Severity::kNote, "TRUTH",
                                 fmt::format("the poses of {} are taken as poses of the IMU",
                                             bag.topics()[*chosen.truth].name),
                                 ""));
  }
}

}  // namespace

tl::expected<Recording, std::string> read_bag(const std::string& path, const BagOptions& options) {
  auto bag = BagFile::open(path);
  if (!bag) return Failure(bag.error());
  auto calibration = read_calibration(options.calibration);
  if (!calibration) return Failure(calibration.error());
  constexpr std::size_t kMaxCameras = 2;
  if (calibration->sensors.cameras.size() > kMaxCameras) {
    return Failure(fmt::format("{} cameras are calibrated; one or two can be used",
                               calibration->sensors.cameras.size()));
  }
  auto chosen = choose_topics((*bag)->topics(), options, calibration->topics);
  if (!chosen) return Failure(fmt::format("{}: {}", path, chosen.error()));
  const BagPreset* const preset = find_preset(options.preset);
  const double density = preset != nullptr ? preset->density : BagPreset{}.density;
  auto recording = BagReading(*bag, *chosen, std::move(*calibration)).run(density);
  if (!recording) return recording;
  add_notes(**bag, *chosen, preset, recording->diagnostics);
  screen_samples(*recording);
  return recording;
}

}  // namespace dive::estimation
