#include "estimation/dataset/asl_dataset.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
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
struct NumberKey {
  const char* key;
  std::optional<double>* value;
  double min;
  double max;
};

// Reads each key that is there. An error if one is not a number, or out of its range.
tl::expected<void, std::string> read_in_range(const SensorFile& file,
                                              std::span<const NumberKey> keys) {
  for (const auto& [key, value, min, max] : keys) {
    const auto number = file.number(key);
    if (!number) return Failure(number.error());
    if (*number && !(**number >= min && **number <= max)) {
      return Failure(file.at(
          key, fmt::format("{} is {:g}; it must be from {:g} to {:g}", key, **number, min, max)));
    }
    *value = *number;
  }
  return {};
}

constexpr double kSpeedSigma = 0.1;  // m/s, per axis: sway and heave are not measured
constexpr double kMaxRate_hz = 1e5;

}  // namespace

tl::expected<RecordedCamera, std::string> read_camera(const SensorFile& file,
                                                      const std::string& path) {
  auto model = read_camera_model(file);
  if (!model) return Failure(model.error());
  const auto X_BC = file.X_BS();
  if (!X_BC) return Failure(X_BC.error());
  RecordedCamera camera;
  std::optional<double> rate;
  const NumberKey keys[] = {{"focal_sigma", &camera.focal_sigma, 0.0, 0.1},
                            {"centre_sigma_px", &camera.centre_sigma_px, 1e-3, 100.0},
                            {"refractive_index_sigma", &camera.refractive_index_sigma, 0.0, 0.1},
                            {"rate_hz", &rate, 0.0, kMaxRate_hz}};
  if (auto read = read_in_range(file, keys); !read) return Failure(read.error());
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

// Reads the data.csv of a folder, whose name becomes the origin's, with a warning for each kind of
// row that is ignored.
tl::expected<void, std::string> read_rows(const fs::path& folder, SampleOrigin& origin,
                                          Diagnostics& diagnostics,
                                          const std::function<std::string(const CsvRow&)>& take) {
  origin.file = (folder / "data.csv").string();
  const auto ignored = for_each_row(origin.file, [&](const CsvRow& row) {
    std::string wrong = take(row);
    if (wrong.empty()) origin.lines.push_back(row.line);
    return wrong;
  });
  if (!ignored) return Failure(ignored.error());
  const auto warn = [&](std::uint32_t line, const char* code, std::string message) {
    Diagnostic warning = origin.of_all(Severity::kWarning, code, std::move(message), "");
    warning.span.line = static_cast<int>(line);
    diagnostics.add(std::move(warning));
  };
  if (ignored->same_time > 0) {
    warn(ignored->first_same_time, "SAME-TIME",
         fmt::format("{} row(s) with the stamp of the row before are ignored; the first is here",
                     ignored->same_time));
  }
  if (ignored->cut_line > 0) {
    warn(ignored->cut_line, "CUT-LINE",
         fmt::format("the file ends within this line, which is ignored: {}", ignored->cut_reason));
  }
  return {};
}

tl::expected<void, std::string> read_images(const fs::path& folder, RecordedCamera& camera,
                                            Diagnostics& diagnostics) {
  const Utime shift = from_seconds(camera.time_shift_s);
  const auto rows = read_rows(folder, camera.images_origin, diagnostics, [&](const CsvRow& row) {
    if (row.fields.empty() || row.fields[0].empty()) return std::string("no file name of an image");
    const fs::path name(row.fields[0]);
    if (name.is_absolute() || name.has_parent_path()) {
      return fmt::format("\"{}\" is no file of the folder data", row.fields[0]);
    }
    camera.images.push_back({row.utime + shift, (folder / "data" / name).string()});
    return std::string();
  });
  if (rows && camera.images.empty()) {
    return Failure(fmt::format("{}: it lists no images", camera.images_origin.file));
  }
  return rows;
}

}  // namespace

tl::expected<Pose, std::string> read_imu_sensor(const SensorFile& file, Recording& dataset) {
  RecordedImuNoise& noise = dataset.imu_noise;
  std::optional<double> rate;
  std::optional<double> gyro_range;
  std::optional<double> accel_range;
  // The ranges are those of VisualInertialOptions.
  const NumberKey keys[] = {{"gyroscope_noise_density", &noise.gyro, 1e-7, 1.0},
                            {"gyroscope_random_walk", &noise.gyro_walk, 1e-9, 1.0},
                            {"accelerometer_noise_density", &noise.accel, 1e-6, 10.0},
                            {"accelerometer_random_walk", &noise.accel_walk, 1e-8, 10.0},
                            {"gyroscope_turn_on_bias", &noise.gyro_bias, 1e-7, 1.0},
                            {"accelerometer_turn_on_bias", &noise.accel_bias, 1e-6, 10.0},
                            {"scale_error", &noise.scale, 0.0, 0.1},
                            {"gyroscope_g_sensitivity", &noise.gyro_by_accel, 0.0, 0.01},
                            {"gyroscope_range", &gyro_range, 0.1, 100.0},
                            {"accelerometer_range", &accel_range, 10.0, 1000.0},
                            {"rate_hz", &rate, 0.0, kMaxRate_hz}};
  if (auto read = read_in_range(file, keys); !read) return Failure(read.error());
  dataset.imu_rate_hz = rate.value_or(0.0);
  noise.gyro_range = gyro_range.value_or(noise.gyro_range);
  noise.accel_range = accel_range.value_or(noise.accel_range);
  return file.X_BS();
}

namespace {

tl::expected<void, std::string> read_imu(const fs::path& folder, Recording& dataset) {
  const auto rows =
      read_rows(folder, dataset.imu_origin, dataset.diagnostics, [&](const CsvRow& row) {
        std::array<double, 6> v{};
        std::string wrong = to_numbers(row, 0, v.size(), v.data());
        if (!wrong.empty()) return wrong;
        ImuSample sample;
        sample.utime = row.utime;
        sample.gyro_B = {v[0], v[1], v[2]};
        sample.accel_B = {v[3], v[4], v[5]};
        dataset.imu.push_back(sample);
        return wrong;
      });
  if (rows && dataset.imu.empty()) {
    return Failure(fmt::format("{}: there are no samples in it", dataset.imu_origin.file));
  }
  return rows;
}

// One that cannot be examined is present: opening it gives the reason.
bool is_present(const fs::path& path) {
  std::error_code error;
  return fs::status(path, error).type() != fs::file_type::not_found;
}

// Reads the keys that the folder's sensor.yaml has, if there is one. Returns the sensor's pose in
// the IMU's frame, if it is stated. `X_BI`: pose of the IMU in the files' body frame.
tl::expected<std::optional<Pose>, std::string> read_mounting(const fs::path& folder,
                                                             const Pose& X_BI,
                                                             std::span<const NumberKey> keys = {}) {
  const fs::path path = folder / "sensor.yaml";
  if (!is_present(path)) return std::nullopt;
  const auto file = SensorFile::open(path.string());
  if (!file) return Failure(file.error());
  if (auto read = read_in_range(*file, keys); !read) return Failure(read.error());
  const auto X_BS = file->X_BS();
  if (!X_BS) return Failure(X_BS.error());
  if (!file->has("T_BS")) return std::nullopt;
  return X_BI.inverse() * *X_BS;
}

// `X_BI`: as of read_mounting().
tl::expected<void, std::string> read_depth(const fs::path& folder, const Pose& X_BI,
                                           Recording& dataset) {
  std::optional<double> noise;
  const NumberKey keys[] = {{"noise_sigma", &noise, 1e-3, 10.0}};
  const auto X_IS = read_mounting(folder, X_BI, keys);
  if (!X_IS) return Failure(X_IS.error());
  dataset.depth_sigma_m = noise.value_or(dataset.depth_sigma_m);
  if (*X_IS) dataset.depth_sensor_B = (*X_IS)->p;
  return read_rows(folder, dataset.depth_origin, dataset.diagnostics, [&](const CsvRow& row) {
    double depth = 0.0;
    std::string wrong = to_numbers(row, 0, 1, &depth);
    if (!wrong.empty()) return wrong;
    dataset.depth.push_back({row.utime, depth});
    return wrong;
  });
}

// `fields`: 3 of a velocity, or 1 of a speed along x of the IMU. `sigma`: without one in
// sensor.yaml. A velocity whose sensor has a pose there is along the axes of that sensor.
tl::expected<void, std::string> read_velocity(const fs::path& folder, std::size_t fields,
                                              double sigma, const Pose& X_BI, Recording& dataset) {
  std::optional<double> noise;
  const NumberKey keys[] = {{"velocity_noise", &noise, 1e-4, 10.0}};
  const auto X_IS = read_mounting(folder, X_BI, keys);
  if (!X_IS) return Failure(X_IS.error());
  sigma = noise.value_or(sigma);
  const Eigen::Quaterniond q_IS =
      fields == 3 && *X_IS ? (*X_IS)->q : Eigen::Quaterniond::Identity();
  return read_rows(folder, dataset.velocity_origin, dataset.diagnostics, [&](const CsvRow& row) {
    std::array<double, 3> v{};
    std::string wrong = to_numbers(row, 0, fields, v.data());
    if (!wrong.empty()) return wrong;
    dataset.velocity.push_back({row.utime, q_IS * Eigen::Vector3d(v[0], v[1], v[2]), sigma});
    return wrong;
  });
}

// How many of a row's fields are read: position, attitude, velocity, biases.
std::size_t columns_of(const CsvRow& row) {
  const std::size_t fields = row.fields.size();
  return fields >= 16 ? 16 : fields >= 10 ? 10 : fields >= 7 ? 7 : 3;
}

// Reads positions, with attitude, velocity and biases where the first row has them. `X_BI`: pose of
// the IMU in the files' body frame; the measured frame may be yet another one.
tl::expected<void, std::string> read_truth(const fs::path& folder, const Pose& X_BI,
                                           Recording& dataset) {
  const auto X_IS = read_mounting(folder, X_BI);
  if (!X_IS) return Failure(X_IS.error());
  const Pose X_SI = *X_IS ? (*X_IS)->inverse() : X_BI;
  std::size_t n = 0;
  return read_rows(folder, dataset.truth_origin, dataset.diagnostics, [&](const CsvRow& row) {
    std::array<double, 16> v{};
    if (dataset.truth.empty()) n = columns_of(row);
    dataset.has_true_attitude = n >= 7;
    std::string wrong = to_numbers(row, 0, n, v.data());
    if (!wrong.empty()) return wrong;
    TruePose pose;
    pose.utime = row.utime;
    pose.X_WB.p = {v[0], v[1], v[2]};
    if (n >= 7) {
      pose.X_WB.q = Eigen::Quaterniond(v[3], v[4], v[5], v[6]);
      if (is_attitude(pose.X_WB.q)) {
        pose.X_WB.q.normalize();
        pose.X_WB = pose.X_WB * X_SI;
      }
    }
    if (n >= 10) pose.v_W = Eigen::Vector3d(v[7], v[8], v[9]);
    if (n == 16) pose.bias = TruePose::Bias{{v[10], v[11], v[12]}, {v[13], v[14], v[15]}};
    dataset.truth.push_back(pose);
    return wrong;
  });
}

fs::path root_of(const std::string& folder) {
  const fs::path given(folder);
  return is_folder(given / "mav0") ? given / "mav0" : given;
}

tl::expected<void, std::string> check_folders(const std::string& folder) {
  const fs::path root = root_of(folder);
  if (is_folder(root / "cam0") && is_folder(root / "imu0")) return {};
  return Failure(fmt::format(
      "{}: no dataset in the ASL format: it has no folders cam0 and imu0, nor mav0 with them",
      folder));
}

// Returns the pose of the IMU in the files' body frame, and fills `dataset` from the sensors'
// files.
tl::expected<Pose, std::string> read_sensors(const std::string& folder, Recording& dataset) {
  if (const auto checked = check_folders(folder); !checked) return Failure(checked.error());
  const fs::path root = root_of(folder);
  const std::string imu = (root / "imu0" / "sensor.yaml").string();
  const auto imu_file = SensorFile::open(imu);
  if (!imu_file) return Failure(imu_file.error());
  auto X_BI = read_imu_sensor(*imu_file, dataset);
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

bool lacks_asl_calibration(const std::string& folder) {
  const fs::path imu = root_of(folder) / "imu0";
  return is_folder(imu) && !is_present(imu / "sensor.yaml");
}

tl::expected<Recording, std::string> read_asl_calibration(const std::string& folder) {
  Recording dataset;
  const auto X_BI = read_sensors(folder, dataset);
  if (!X_BI) return Failure(X_BI.error());
  return dataset;
}

namespace {

// The same with the given sensors, whose body frame is the IMU's. The files' own may still be
// another one, in which the truth's sensor is then.
tl::expected<Pose, std::string> take_sensors(const std::string& folder, Recording sensors,
                                             Recording& dataset) {
  if (const auto checked = check_folders(folder); !checked) return Failure(checked.error());
  const fs::path root = root_of(folder);
  dataset = std::move(sensors);
  if (dataset.cameras.size() > 1 && !is_folder(root / "cam1")) dataset.cameras.resize(1);
  const fs::path imu = root / "imu0" / "sensor.yaml";
  if (!is_present(imu)) return Pose{};
  const auto file = SensorFile::open(imu.string());
  if (!file) return Failure(file.error());
  return file->X_BS();
}

}  // namespace

tl::expected<Recording, std::string> read_asl_dataset(const std::string& folder,
                                                      std::optional<Recording> sensors) {
  const fs::path root = root_of(folder);
  Recording dataset;
  const auto X_BI =
      sensors ? take_sensors(folder, std::move(*sensors), dataset) : read_sensors(folder, dataset);
  if (!X_BI) return Failure(X_BI.error());
  dataset.source = folder;
  if (const auto read = read_imu(root / "imu0", dataset); !read) return Failure(read.error());
  for (std::size_t i = 0; i < dataset.cameras.size(); ++i) {
    const auto read =
        read_images(root / fmt::format("cam{}", i), dataset.cameras[i], dataset.diagnostics);
    if (!read) return Failure(read.error());
  }
  if (is_folder(root / "depth0")) {
    const auto read = read_depth(root / "depth0", *X_BI, dataset);
    if (!read) return Failure(read.error());
  }
  if (is_folder(root / "dvl0")) {
    const auto read = read_velocity(root / "dvl0", 3, kDvlSigma, *X_BI, dataset);
    if (!read) return Failure(read.error());
  } else if (is_folder(root / "speed0")) {
    const auto read = read_velocity(root / "speed0", 1, kSpeedSigma, *X_BI, dataset);
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
