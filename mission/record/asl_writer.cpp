#include "mission/record/asl_writer.h"

#include <filesystem>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>

#include "common/assert.h"
#include "common/input_file.h"
#include "estimation/dataset/camera_calibration.h"
#include "estimation/dataset/gray_png.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

enum Sensor : std::size_t { kCamera0, kCamera1, kImu, kDepth, kTruth, kSensors };

constexpr std::array<const char*, kSensors> kFolders{"cam0", "cam1", "imu0", "depth0",
                                                     "state_groundtruth_estimate0"};
constexpr std::array<const char*, kSensors> kColumns{
    "#timestamp [ns],filename", "#timestamp [ns],filename",
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]",
    "#timestamp [ns],depth [m]",
    "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
    "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
    "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
    "b_a_RS_S_z [m s^-2]"};

std::int64_t nanoseconds(Utime utime) { return 1000 * utime; }

std::string xyz(const Eigen::Vector3d& v) {
  return fmt::format("{:.9g},{:.9g},{:.9g}", v.x(), v.y(), v.z());
}

// Calibration is written with full precision, so that readers compute with the same cameras.
std::string pose_yaml(const Pose& X) {
  const Eigen::Matrix3d R = X.q.toRotationMatrix();
  std::string rows;
  for (int i = 0; i < 3; ++i) {
    rows += fmt::format("{}, {}, {}, {},\n         ", R(i, 0), R(i, 1), R(i, 2), X.p[i]);
  }
  return "T_BS:\n  cols: 4\n  rows: 4\n  data: [" + rows + "0.0, 0.0, 0.0, 1.0]\n";
}

// Any comment becomes one quoted line.
std::string head(const std::string& type, const std::string& comment, const Pose& X_BS) {
  std::string quoted;
  for (const char c : comment) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return fmt::format("sensor_type: {}\ncomment: \"{}\"\n", type, quoted) + pose_yaml(X_BS);
}

std::string camera_yaml(const CameraModel& camera, const AslSensors& sensors) {
  return head("camera", sensors.comment, camera.X_BC) +
         fmt::format("rate_hz: {}\n", sensors.camera_rate_hz) +
         estimation::camera_model_yaml(camera) + "focal_sigma: 0  # simulated: exact\n";
}

std::string imu_yaml(const AslSensors& sensors) {
  const vehicle::ImuNoise& imu = sensors.imu;
  return head("imu", sensors.comment, {}) +
         fmt::format(
             "rate_hz: {}\ngyroscope_noise_density: {}\ngyroscope_random_walk: {}\n"
             "accelerometer_noise_density: {}\naccelerometer_random_walk: {}\n"
             "gyroscope_turn_on_bias: {}\naccelerometer_turn_on_bias: {}\n"
             "scale_error: {}\ngyroscope_g_sensitivity: {}\n",
             sensors.imu_rate_hz, imu.gyro_density, imu.gyro_walk, imu.accel_density,
             imu.accel_walk, imu.gyro_bias_sigma, imu.accel_bias_sigma, imu.scale_sigma,
             imu.g_sensitivity_sigma);
}

std::string depth_yaml(const AslSensors& sensors) {
  return head("depth", sensors.comment, {}) + fmt::format("rate_hz: {:.9g}\nnoise_sigma: {:.9g}\n",
                                                          sensors.depth_rate_hz,
                                                          sensors.depth_sigma_m);
}

std::string yaml(std::size_t sensor, const AslSensors& sensors) {
  switch (sensor) {
    case kCamera0:
    case kCamera1:
      return camera_yaml(sensors.cameras[sensor], sensors);
    case kImu:
      return imu_yaml(sensors);
    case kDepth:
      return depth_yaml(sensors);
    default:
      return head("visual-inertial", sensors.comment, {});
  }
}

using Kind = OutputError::Kind;

tl::unexpected<OutputError> not_written(const fs::path& path, const std::string& reason) {
  return tl::make_unexpected(
      OutputError{Kind::kNotKept, fmt::format("{}: cannot be written: {}", path.string(), reason)});
}

tl::expected<void, OutputError> create_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error) return {};
  const bool is_full = error == std::errc::no_space_on_device || error == std::errc::io_error;
  return tl::make_unexpected(OutputError{is_full ? Kind::kNotKept : Kind::kName,
                                         fmt::format("{}: {}", folder.string(), error.message())});
}

tl::expected<void, OutputError> write_yaml(const fs::path& folder, std::size_t sensor,
                                           const AslSensors& sensors, Existing existing) {
  if (auto created = create_folder(folder); !created) return created;
  return write_output((folder / "sensor.yaml").string(), existing, yaml(sensor, sensors));
}

/// Removes the dataset of an earlier recording.
tl::expected<void, OutputError> remove_dataset(const fs::path& root) {
  std::error_code error;
  for (fs::recursive_directory_iterator it(root, error), end; !error && it != end;
       it.increment(error)) {
    struct stat status {};
    if (::stat(it->path().c_str(), &status) != 0 || !is_input(status)) continue;
    return tl::make_unexpected(OutputError{
        Kind::kInput,
        fmt::format("{}: is an input of this command, and is never written", it->path().string())});
  }
  fs::remove_all(root, error);
  if (!error) return {};
  return tl::make_unexpected(
      OutputError{Kind::kName, fmt::format("{}: {}", root.string(), error.message())});
}

}  // namespace

tl::expected<void, OutputError> write_asl_calibration(const std::string& folder,
                                                      const AslSensors& sensors,
                                                      Existing existing) {
  for (const std::size_t sensor : {kCamera0, kCamera1, kImu}) {
    auto written = write_yaml(fs::path(folder) / kFolders[sensor], sensor, sensors, existing);
    if (!written) return written;
  }
  return {};
}

struct AslWriter::Impl {
  fs::path root;
  std::vector<OutputFile> rows;     // in the order of kFolders
  std::optional<OutputError> lost;  // the first part that could not be written

  tl::expected<void, OutputError> open(const AslSensors& sensors) {
    for (std::size_t i = 0; i < kSensors; ++i) {
      const fs::path folder = root / kFolders[i];
      if (auto written = write_yaml(folder, i, sensors, Existing::kRefuse); !written) {
        return written;
      }
      if (i <= kCamera1) {
        if (auto created = create_folder(folder / "data"); !created) return created;
      }
      auto file = OutputFile::create((folder / "data.csv").string(), Existing::kRefuse);
      if (!file) return tl::unexpected(std::move(file.error()));
      file->keep();  // the rows written before an error are of use
      rows.push_back(std::move(*file));
      put(i, std::string(kColumns[i]) + "\n");
    }
    return lost ? tl::expected<void, OutputError>(tl::unexpected(*lost))
                : tl::expected<void, OutputError>();
  }

  void put(std::size_t sensor, const std::string& line) { note(rows[sensor].write(line)); }

  /// Keeps the first error; whatever it is, a part of the dataset is not there.
  void note(const tl::expected<void, OutputError>& written) {
    if (!written && !lost) lost = OutputError{Kind::kNotKept, written.error().message};
  }
};

AslWriter::AslWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AslWriter::AslWriter(AslWriter&&) noexcept = default;
AslWriter& AslWriter::operator=(AslWriter&&) noexcept = default;
AslWriter::~AslWriter() = default;

tl::expected<AslWriter, OutputError> AslWriter::create(const std::string& folder,
                                                       const AslSensors& sensors,
                                                       Existing existing) {
  for (const CameraModel& camera : sensors.cameras) DIVE_DEMAND(camera.validate().empty());
  auto impl = std::make_unique<Impl>();
  impl->root = fs::path(folder) / "mav0";
  std::error_code ignored;  // a folder that cannot be listed cannot be written either
  if (fs::exists(fs::symlink_status(impl->root, ignored))) {
    if (existing == Existing::kRefuse) {
      return tl::make_unexpected(
          OutputError{Kind::kExists, fmt::format("{}: holds a dataset already (mav0)", folder)});
    }
    if (auto removed = remove_dataset(impl->root); !removed) {
      return tl::unexpected(std::move(removed.error()));
    }
  }
  if (auto opened = impl->open(sensors); !opened) {
    return tl::unexpected(std::move(opened.error()));
  }
  return AslWriter(std::move(impl));
}

void AslWriter::write(const ImageFrame& frame) {
  DIVE_DEMAND(frame.camera == 0 || frame.camera == 1);
  const auto sensor = static_cast<std::size_t>(frame.camera);
  const std::string name = fmt::format("{}.png", nanoseconds(frame.utime));
  const fs::path path = impl_->root / kFolders[sensor] / "data" / name;
  const tl::expected<std::string, std::string> png = estimation::to_gray_png(frame);
  impl_->note(png ? write_output(path.string(), Existing::kRefuse, *png)
                  : not_written(path, png.error()));
  impl_->put(sensor, fmt::format("{},{}\n", nanoseconds(frame.utime), name));
}

void AslWriter::write(const ImuSample& sample) {
  impl_->put(kImu, fmt::format("{},{},{}\n", nanoseconds(sample.utime), xyz(sample.gyro_B),
                               xyz(sample.accel_B)));
}

void AslWriter::write(const DepthSample& sample) {
  impl_->put(kDepth, fmt::format("{},{:.9g}\n", nanoseconds(sample.utime), sample.depth_m));
}

void AslWriter::write(const AslTruth& truth) {
  const Eigen::Quaterniond& q = truth.X_WB.q;
  impl_->put(kTruth,
             fmt::format("{},{},{:.9g},{:.9g},{:.9g},{:.9g},{},{},{}\n", nanoseconds(truth.utime),
                         xyz(truth.X_WB.p), q.w(), q.x(), q.y(), q.z(), xyz(truth.v_W),
                         xyz(truth.gyro_bias_B), xyz(truth.accel_bias_B)));
}

tl::expected<void, OutputError> AslWriter::close() {
  for (OutputFile& file : impl_->rows) impl_->note(file.close());
  if (impl_->lost) return tl::unexpected(*impl_->lost);
  return {};
}

}  // namespace dive::mission
