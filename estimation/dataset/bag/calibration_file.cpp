#include "estimation/dataset/bag/calibration_file.h"

#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "common/input_file.h"
#include "estimation/dataset/asl_dataset.h"
#include "estimation/dataset/sensor_file.h"

namespace dive::estimation {
namespace {

namespace fs = std::filesystem;

using Failure = tl::unexpected<std::string>;

constexpr double kMaxShift_s = 1.0;

// What has been read so far.
struct Parts {
  Calibration calibration;
  std::vector<bool> in_body;  ///< Of each camera: its pose is in the body frame, not the IMU's.
  Pose X_BI;                  ///< Of the IMU in the body frame.
};

tl::expected<void, std::string> add_camera(const SensorFile& file, const std::string& path,
                                           Parts& parts) {
  auto camera = read_camera(file, path);
  if (!camera) return Failure(camera.error());
  const auto topic = file.word("rostopic");
  if (!topic) return Failure(topic.error());
  const auto shift = file.number("timeshift_cam_imu");
  if (!shift) return Failure(shift.error());
  camera->time_shift_s = shift->value_or(0.0);
  if (std::abs(camera->time_shift_s) > kMaxShift_s) {
    return Failure(file.at(
        "timeshift_cam_imu",
        fmt::format("a time shift of {:g} s; at most {:g} s", camera->time_shift_s, kMaxShift_s)));
  }
  parts.calibration.sensors.cameras.push_back(std::move(*camera));
  parts.calibration.topics.cameras.push_back(topic->value_or(""));
  parts.in_body.push_back(!file.has("T_cam_imu"));
  return {};
}

// A stereo pair is used; calibrations of more cameras exist.
void note_unused_cameras(const SensorFile& file, const std::string& path,
                         Diagnostics& diagnostics) {
  std::string unused;
  for (int i = 2; file.has(fmt::format("cam{}", i)); ++i) {
    unused += fmt::format("{}cam{}", unused.empty() ? "" : ", ", i);
  }
  if (unused.empty()) return;
  Diagnostic note;
  note.code = "CAMERAS";
  note.severity = Severity::kNote;
  note.file = path;
  note.message = fmt::format("not used: {}; only cam0 and cam1 are", unused);
  note.hint = "to use others, name them cam0 and cam1 in a copy of the file";
  diagnostics.add(std::move(note));
}

tl::expected<void, std::string> add_chain(const SensorFile& file, const std::string& path,
                                          Parts& parts) {
  for (const char* const name : {"cam0", "cam1"}) {
    const auto section = file.section(name);
    if (!section) continue;
    if (!section->has("T_cam_imu") && !section->has("T_BS")) {
      return Failure(fmt::format(
          "{}:{}: {} has no T_cam_imu; a chain of cameras calibrated with an IMU is expected", path,
          file.line_of(name), name));
    }
    const auto added = add_camera(*section, path, parts);
    if (!added) return added;
  }
  note_unused_cameras(file, path, parts.calibration.sensors.diagnostics);
  return {};
}

tl::expected<void, std::string> add_imu(const SensorFile& file, Parts& parts) {
  const auto X_BI = read_imu_sensor(file, parts.calibration.sensors);
  if (!X_BI) return Failure(X_BI.error());
  const auto topic = file.word("rostopic");
  if (!topic) return Failure(topic.error());
  parts.X_BI = *X_BI;
  parts.calibration.topics.imu = topic->value_or("");
  return {};
}

tl::expected<void, std::string> add_file(const std::string& path, Parts& parts) {
  const auto file = SensorFile::open(path);
  if (!file) return Failure(file.error());
  const auto imu = file->section("imu0");
  const bool has_cameras = file->has("cam0");
  if (has_cameras) {
    const auto added = add_chain(*file, path, parts);
    if (!added) return added;
  }
  if (imu) return add_imu(*imu, parts);
  if (file->has("gyroscope_noise_density")) return add_imu(*file, parts);
  if (file->has("intrinsics")) return add_camera(*file, path, parts);
  if (has_cameras) return {};
  return Failure(fmt::format(
      "{}: no calibration: it has neither cam0, imu0, intrinsics nor gyroscope_noise_density",
      path));
}

// The cameras of a folder are in its IMU's frame already.
void add_folder(Recording sensors, Parts& parts) {
  Calibration& calibration = parts.calibration;
  for (RecordedCamera& camera : sensors.cameras) {
    calibration.sensors.cameras.push_back(std::move(camera));
    calibration.topics.cameras.emplace_back();
    parts.in_body.push_back(false);
  }
  calibration.sensors.imu_noise = sensors.imu_noise;
  calibration.sensors.imu_rate_hz = sensors.imu_rate_hz;
}

}  // namespace

std::vector<std::string> calibration_beside(const std::string& recording) {
  const fs::path given(recording);
  for (const fs::path& root : {given, given / ".."}) {
    const fs::path cameras = root / "dso" / "camchain.yaml";
    const fs::path imu = root / "dso" / "imu_config.yaml";
    if (is_regular_file(cameras) && is_regular_file(imu)) return {cameras.string(), imu.string()};
  }
  return {};
}

tl::expected<Calibration, std::string> read_calibration(const std::vector<std::string>& paths) {
  Parts parts;
  for (const std::string& path : paths) {
    if (is_folder(path)) {
      auto sensors = read_asl_calibration(path);
      if (!sensors) return Failure(sensors.error());
      add_folder(std::move(*sensors), parts);
      continue;
    }
    const auto added = add_file(path, parts);
    if (!added) return Failure(added.error());
  }
  std::vector<RecordedCamera>& cameras = parts.calibration.sensors.cameras;
  if (cameras.empty()) {
    return Failure(fmt::format("{}: no camera is calibrated there",
                               paths.empty() ? "no calibration" : paths.front()));
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (parts.in_body[i]) cameras[i].model.X_BC = parts.X_BI.inverse() * cameras[i].model.X_BC;
  }
  return std::move(parts.calibration);
}

}  // namespace dive::estimation
