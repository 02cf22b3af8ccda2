#include "estimation/dataset/bag/calibration_file.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/input_file.h"
#include "estimation/dataset/asl_dataset.h"
#include "estimation/dataset/sensor_file.h"

namespace dive::estimation {
namespace {

using Failure = tl::unexpected<std::string>;

constexpr double kMaxShift_s = 1.0;

tl::expected<void, std::string> add_camera(const SensorFile& file, const std::string& path,
                                           Calibration& calibration) {
  auto camera = read_camera(file, path);
  if (!camera) return Failure(camera.error());
  const auto topic = file.word("rostopic");
  if (!topic) return Failure(topic.error());
  const auto shift = file.number("timeshift_cam_imu");
  if (!shift) return Failure(shift.error());
  if (std::abs(shift->value_or(0.0)) > kMaxShift_s) {
    return Failure(fmt::format("{}:{}: a time shift of {:g} s; at most {:g} s", path,
                               file.line_of("timeshift_cam_imu"), **shift, kMaxShift_s));
  }
  calibration.sensors.cameras.push_back(std::move(*camera));
  calibration.topics.push_back(topic->value_or(""));
  calibration.shifts_s.push_back(shift->value_or(0.0));
  return {};
}

tl::expected<void, std::string> add_chain(const SensorFile& file, const std::string& path,
                                          Calibration& calibration) {
  for (const char* const name : {"cam0", "cam1"}) {
    const auto section = file.section(name);
    if (!section) continue;
    if (!section->has("T_cam_imu") && !section->has("T_BS")) {
      return Failure(fmt::format(
          "{}:{}: {} has no T_cam_imu; a chain of cameras calibrated with an IMU is expected", path,
          file.line_of(name), name));
    }
    const auto added = add_camera(*section, path, calibration);
    if (!added) return added;
  }
  return {};
}

tl::expected<void, std::string> add_imu(const SensorFile& file, Calibration& calibration) {
  const auto X_BI = read_imu_sensor(file, calibration.sensors);
  if (!X_BI) return Failure(X_BI.error());
  return {};
}

tl::expected<void, std::string> add_file(const std::string& path, Calibration& calibration) {
  const auto file = SensorFile::open(path);
  if (!file) return Failure(file.error());
  const auto imu = file->section("imu0");
  const bool has_cameras = file->has("cam0");
  if (has_cameras) {
    const auto added = add_chain(*file, path, calibration);
    if (!added) return added;
  }
  if (imu) return add_imu(*imu, calibration);
  if (file->has("gyroscope_noise_density")) return add_imu(*file, calibration);
  if (file->has("intrinsics")) return add_camera(*file, path, calibration);
  if (has_cameras) return {};
  return Failure(fmt::format(
      "{}: no calibration: it has neither cam0, imu0, intrinsics nor gyroscope_noise_density",
      path));
}

void add_folder(Recording sensors, Calibration& calibration) {
  calibration.topics.resize(calibration.topics.size() + sensors.cameras.size());
  calibration.shifts_s.resize(calibration.topics.size());
  for (RecordedCamera& camera : sensors.cameras) {
    calibration.sensors.cameras.push_back(std::move(camera));
  }
  calibration.sensors.imu_noise = sensors.imu_noise;
  calibration.sensors.imu_rate_hz = sensors.imu_rate_hz;
}

}  // namespace

tl::expected<Calibration, std::string> read_calibration(const std::vector<std::string>& paths) {
  Calibration calibration;
  for (const std::string& path : paths) {
    if (is_folder(path)) {
      auto sensors = read_asl_calibration(path);
      if (!sensors) return Failure(sensors.error());
      add_folder(std::move(*sensors), calibration);
      continue;
    }
    const auto added = add_file(path, calibration);
    if (!added) return Failure(added.error());
  }
  if (calibration.sensors.cameras.empty()) {
    return Failure(fmt::format("{}: no camera is calibrated there",
                               paths.empty() ? "no calibration" : paths.front()));
  }
  return calibration;
}

}  // namespace dive::estimation
