#include "estimation/dataset/asl_dataset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <span>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "common/input_file.h"
#include "estimation/dataset/camera_calibration.h"
#include "estimation/dataset/csv_table.h"
#include "estimation/dataset/sample_screen.h"
#include "estimation/dataset/sensor_file.h"

namespace dive::estimation {
namespace {

namespace fs = std::filesystem;

using Failure = tl::unexpected<std::string>;
using NumberKey = std::pair<const char*, std::optional<double>*>;

// Reads each key that is there. An error if one is no number, or negative.
tl::expected<void, std::string> read_positive(const SensorFile& file, const std::string& path,
                                              std::span<const NumberKey> keys) {
  for (const auto& [key, value] : keys) {
    const auto number = file.number(key);
    if (!number) return Failure(number.error());
    if (*number && !(**number >= 0.0)) return Failure(fmt::format("{}: {} is negative", path, key));
    *value = *number;
  }
  return {};
}

constexpr double kSpeedSigma = 0.1;  // m/s, per axis: sway and heave are not measured

}  // namespace

tl::expected<RecordedCamera, std::string> read_camera(const SensorFile& file,
                                                      const std::string& path) {
  auto model = read_camera_model(file);
  if (!model) return Failure(model.error());
  const auto X_BC = file.X_BS();
  if (!X_BC) return Failure(X_BC.error());
  RecordedCamera camera;
  std::optional<double> rate;
  const NumberKey keys[] = {{"focal_sigma", &camera.focal_sigma},
                            {"centre_sigma_px", &camera.centre_sigma_px},
                            {"refractive_index_sigma", &camera.refractive_index_sigma},
                            {"rate_hz", &rate}};
  if (auto read = read_positive(file, path, keys); !read) return Failure(read.error());
  camera.model = *model;
  camera.model.X_BC = *X_BC;
  camera.rate_hz = rate.value_or(0.0);
  camera.calibration_file = path;
  camera.resolution_line = file.line_of("resolution");
  if (const std::string why = camera.model.validate(); !why.empty()) {
    return Failure(fmt::format("{}: {}", path, why));
  }
  return camera;
}

namespace {

tl::expected<void, std::string> read_images(const fs::path& folder, RecordedCamera& camera) {
  camera.images_origin.file = (folder / "data.csv").string();
  const auto rows = for_each_row((folder / "data.csv").string(), [&](const CsvRow& row) {
    if (row.fields.empty() || row.fields[0].empty()) return std::string("no file name of an image");
    const fs::path name(row.fields[0]);
    if (name.is_absolute() || name.has_parent_path()) {
      return fmt::format("\"{}\" is no file of the folder data", row.fields[0]);
    }
    camera.images.push_back({row.utime, (folder / "data" / name).string()});
    camera.images_origin.lines.push_back(row.line);
    return std::string();
  });
  if (rows && camera.images.empty()) {
    return Failure(fmt::format("{}: it lists no images", (folder / "data.csv").string()));
  }
  return rows;
}

}  // namespace

tl::expected<Pose, std::string> read_imu_sensor(const SensorFile& file, const std::string& path,
                                                Recording& dataset) {
  RecordedImuNoise& noise = dataset.imu_noise;
  std::optional<double> rate;
  const NumberKey keys[] = {{"gyroscope_noise_density", &noise.gyro},
                            {"gyroscope_random_walk", &noise.gyro_walk},
                            {"accelerometer_noise_density", &noise.accel},
                            {"accelerometer_random_walk", &noise.accel_walk},
                            {"gyroscope_turn_on_bias", &noise.gyro_bias},
                            {"accelerometer_turn_on_bias", &noise.accel_bias},
                            {"scale_error", &noise.scale},
                            {"gyroscope_g_sensitivity", &noise.gyro_by_accel},
                            {"rate_hz", &rate}};
  if (auto read = read_positive(file, path, keys); !read) return Failure(read.error());
  dataset.imu_rate_hz = rate.value_or(0.0);
  return file.X_BS();
}

namespace {

tl::expected<void, std::string> read_imu(const fs::path& folder, Recording& dataset) {
  dataset.imu_origin.file = (folder / "data.csv").string();
  const auto rows = for_each_row((folder / "data.csv").string(), [&](const CsvRow& row) {
    std::array<double, 6> v{};
    std::string wrong = to_numbers(row, 0, v.size(), v.data());
    if (!wrong.empty()) return wrong;
    ImuSample sample;
    sample.utime = row.utime;
    sample.gyro_B = {v[0], v[1], v[2]};
    sample.accel_B = {v[3], v[4], v[5]};
    dataset.imu.push_back(sample);
    dataset.imu_origin.lines.push_back(row.line);
    return wrong;
  });
  if (rows && dataset.imu.empty()) {
    return Failure(fmt::format("{}: there are no samples in it", (folder / "data.csv").string()));
  }
  return rows;
}

tl::expected<void, std::string> read_depth(const fs::path& folder, Recording& dataset) {
  dataset.depth_origin.file = (folder / "data.csv").string();
  return for_each_row((folder / "data.csv").string(), [&](const CsvRow& row) {
    double depth = 0.0;
    std::string wrong = to_numbers(row, 0, 1, &depth);
    if (!wrong.empty()) return wrong;
    dataset.depth.push_back({row.utime, depth});
    dataset.depth_origin.lines.push_back(row.line);
    return wrong;
  });
}

// One that cannot be examined is present: opening it gives the reason.
bool is_present(const fs::path& path) {
  std::error_code error;
  return fs::status(path, error).type() != fs::file_type::not_found;
}

// `fields`: 3 of a velocity, or 1 of a speed along x. `sigma`: without one in sensor.yaml.
tl::expected<void, std::string> read_velocity(const fs::path& folder, std::size_t fields,
                                              double sigma, Recording& dataset) {
  const fs::path sensor = folder / "sensor.yaml";
  if (is_present(sensor)) {
    const auto file = SensorFile::open(sensor.string());
    if (!file) return Failure(file.error());
    const auto noise = file->number("velocity_noise");
    if (!noise) return Failure(noise.error());
    sigma = noise->value_or(sigma);
    if (!(sigma > 0.0)) {
      return Failure(fmt::format("{}: velocity_noise is not positive", sensor.string()));
    }
  }
  dataset.velocity_origin.file = (folder / "data.csv").string();
  return for_each_row((folder / "data.csv").string(), [&](const CsvRow& row) {
    std::array<double, 3> v{};
    std::string wrong = to_numbers(row, 0, fields, v.data());
    if (!wrong.empty()) return wrong;
    dataset.velocity.push_back({row.utime, {v[0], v[1], v[2]}, sigma});
    dataset.velocity_origin.lines.push_back(row.line);
    return wrong;
  });
}

// Reads positions, with attitude, velocity and biases where there are fields for them. `X_BI`: pose
// of the IMU in the files' body frame; the measured frame may be yet another one.
tl::expected<void, std::string> read_truth(const fs::path& folder, const Pose& X_BI,
                                           Recording& dataset) {
  Pose X_BS = X_BI;
  const fs::path calibration = folder / "sensor.yaml";
  if (is_present(calibration)) {
    const auto file = SensorFile::open(calibration.string());
    if (!file) return Failure(file.error());
    const auto X_BR = file->X_BS();
    if (!X_BR) return Failure(X_BR.error());
    X_BS = X_BR->inverse() * X_BI;
  }
  dataset.has_true_attitude = true;
  dataset.truth_origin.file = (folder / "data.csv").string();
  return for_each_row((folder / "data.csv").string(), [&](const CsvRow& row) {
    std::array<double, 16> v{};
    const std::size_t fields = row.fields.size();
    const std::size_t n = fields >= 16 ? 16 : fields >= 10 ? 10 : fields >= 7 ? 7 : 3;
    std::string wrong = to_numbers(row, 0, n, v.data());
    if (!wrong.empty()) return wrong;
    TruePose pose;
    pose.utime = row.utime;
    pose.X_WB.p = {v[0], v[1], v[2]};
    if (n >= 7) {
      const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
      if (std::abs(q.norm() - 1.0) > 1e-2) return std::string("its quaternion is not of length 1");
      pose.X_WB.q = q.normalized();
      pose.X_WB = pose.X_WB * X_BS;
    } else {
      dataset.has_true_attitude = false;
    }
    if (n >= 10) pose.v_W = Eigen::Vector3d(v[7], v[8], v[9]);
    if (n == 16) pose.bias = TruePose::Bias{{v[10], v[11], v[12]}, {v[13], v[14], v[15]}};
    dataset.truth.push_back(pose);
    dataset.truth_origin.lines.push_back(row.line);
    return wrong;
  });
}

fs::path root_of(const std::string& folder) {
  const fs::path given(folder);
  return is_folder(given / "mav0") ? given / "mav0" : given;
}

// Returns the pose of the IMU in the files' body frame, and fills `dataset` from the sensors'
// files.
tl::expected<Pose, std::string> read_sensors(const std::string& folder, Recording& dataset) {
  const fs::path root = root_of(folder);
  if (!is_folder(root / "cam0") || !is_folder(root / "imu0")) {
    return Failure(fmt::format(
        "{}: no dataset in the ASL format: it has no folders cam0 and imu0, nor mav0 with them",
        folder));
  }
  const std::string imu = (root / "imu0" / "sensor.yaml").string();
  const auto imu_file = SensorFile::open(imu);
  if (!imu_file) return Failure(imu_file.error());
  auto X_BI = read_imu_sensor(*imu_file, imu, dataset);
  if (!X_BI) return X_BI;
  for (const char* name : {"cam0", "cam1"}) {
    if (!is_folder(root / name)) continue;
    const std::string path = (root / name / "sensor.yaml").string();
    const auto file = SensorFile::open(path);
    if (!file) return Failure(file.error());
    auto camera = read_camera(*file, path);
    if (!camera) return Failure(camera.error());
    camera->model.X_BC = X_BI->inverse() * camera->model.X_BC;
    dataset.cameras.push_back(std::move(*camera));
  }
  return X_BI;
}

}  // namespace

tl::expected<Recording, std::string> read_asl_calibration(const std::string& folder) {
  Recording dataset;
  const auto X_BI = read_sensors(folder, dataset);
  if (!X_BI) return Failure(X_BI.error());
  return dataset;
}

tl::expected<Recording, std::string> read_asl_dataset(const std::string& folder) {
  const fs::path root = root_of(folder);
  Recording dataset;
  dataset.source = folder;
  const auto X_BI = read_sensors(folder, dataset);
  if (!X_BI) return Failure(X_BI.error());
  if (const auto read = read_imu(root / "imu0", dataset); !read) return Failure(read.error());
  for (std::size_t i = 0; i < dataset.cameras.size(); ++i) {
    const auto read = read_images(root / fmt::format("cam{}", i), dataset.cameras[i]);
    if (!read) return Failure(read.error());
  }
  if (is_folder(root / "depth0")) {
    const auto read = read_depth(root / "depth0", dataset);
    if (!read) return Failure(read.error());
  }
  if (is_folder(root / "dvl0")) {
    const auto read = read_velocity(root / "dvl0", 3, kDvlSigma, dataset);
    if (!read) return Failure(read.error());
  } else if (is_folder(root / "speed0")) {
    const auto read = read_velocity(root / "speed0", 1, kSpeedSigma, dataset);
    if (!read) return Failure(read.error());
  }
  for (const char* name : {"state_groundtruth_estimate0", "mocap0", "vicon0", "leica0"}) {
    if (!is_folder(root / name)) continue;
    const auto read = read_truth(root / name, *X_BI, dataset);
    if (!read) return Failure(read.error());
    break;
  }
  screen_samples(dataset);
  return dataset;
}

}  // namespace dive::estimation
