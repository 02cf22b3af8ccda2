#include "mission/record/asl_writer.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "common/assert.h"
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
  const auto& k = camera.radtan;
  return head("camera", sensors.comment, camera.X_BC) +
         fmt::format(
             "rate_hz: {}\nresolution: [{}, {}]\ncamera_model: pinhole\n"
             "intrinsics: [{}, {}, {}, {}]  # fu, fv, cu, cv\n"
             "distortion_model: radial-tangential\n"
             "distortion_coefficients: [{}, {}, {}, {}]\n",
             sensors.camera_rate_hz, camera.width, camera.height, camera.fx, camera.fy, camera.cx,
             camera.cy, k[0], k[1], k[2], k[3]);
}

std::string imu_yaml(const AslSensors& sensors) {
  return head("imu", sensors.comment, {}) +
         fmt::format(
             "rate_hz: {}\ngyroscope_noise_density: {}\ngyroscope_random_walk: {}\n"
             "accelerometer_noise_density: {}\naccelerometer_random_walk: {}\n",
             sensors.imu_rate_hz, sensors.gyro_density, sensors.gyro_walk, sensors.accel_density,
             sensors.accel_walk);
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

// Empty, or an error message.
std::string write_yaml(const fs::path& folder, std::size_t sensor, const AslSensors& sensors) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fmt::format("{}: {}", folder.string(), error.message());
  std::ofstream file(folder / "sensor.yaml");
  file << yaml(sensor, sensors);
  file.close();
  return file ? "" : fmt::format("{}: cannot be written", (folder / "sensor.yaml").string());
}

}  // namespace

tl::expected<void, std::string> write_asl_calibration(const std::string& folder,
                                                      const AslSensors& sensors) {
  for (const std::size_t sensor : {kCamera0, kCamera1, kImu}) {
    std::string problem = write_yaml(fs::path(folder) / kFolders[sensor], sensor, sensors);
    if (!problem.empty()) return tl::unexpected(std::move(problem));
  }
  return {};
}

struct AslWriter::Impl {
  fs::path root;
  std::array<std::ofstream, kSensors> rows;
  std::string lost;  // the first image that could not be written

  // Empty, or an error message.
  std::string open(const AslSensors& sensors) {
    for (std::size_t i = 0; i < kSensors; ++i) {
      const fs::path folder = root / kFolders[i];
      if (std::string problem = write_yaml(folder, i, sensors); !problem.empty()) return problem;
      std::error_code error;
      if (i <= kCamera1) fs::create_directory(folder / "data", error);
      if (error) return fmt::format("{}: {}", (folder / "data").string(), error.message());
      rows[i].open(folder / "data.csv");
      rows[i] << kColumns[i] << '\n';
      if (!rows[i]) return fmt::format("{}: cannot be written", (folder / "data.csv").string());
    }
    return {};
  }
};

AslWriter::AslWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AslWriter::AslWriter(AslWriter&&) noexcept = default;
AslWriter& AslWriter::operator=(AslWriter&&) noexcept = default;
AslWriter::~AslWriter() = default;

tl::expected<AslWriter, std::string> AslWriter::create(const std::string& folder,
                                                       const AslSensors& sensors) {
  for (const CameraModel& camera : sensors.cameras) DIVE_DEMAND(camera.validate().empty());
  auto impl = std::make_unique<Impl>();
  impl->root = fs::path(folder) / "mav0";
  std::error_code ignored;  // a folder that cannot be listed cannot be written either
  if (fs::exists(impl->root, ignored)) {
    return tl::unexpected(
        fmt::format("{}: holds a dataset already; give another folder, or remove mav0", folder));
  }
  if (std::string problem = impl->open(sensors); !problem.empty()) {
    return tl::unexpected(std::move(problem));
  }
  return AslWriter(std::move(impl));
}

void AslWriter::write(const ImageFrame& frame) {
  DIVE_DEMAND(frame.camera == 0 || frame.camera == 1);
  const auto sensor = static_cast<std::size_t>(frame.camera);
  const std::string name = fmt::format("{}.png", nanoseconds(frame.utime));
  const fs::path path = impl_->root / kFolders[sensor] / "data" / name;
  const bool is_written = estimation::write_gray_png(path.string(), frame);
  if (!is_written && impl_->lost.empty()) impl_->lost = path.string();
  fmt::print(impl_->rows[sensor], "{},{}\n", nanoseconds(frame.utime), name);
}

void AslWriter::write(const ImuSample& sample) {
  fmt::print(impl_->rows[kImu], "{},{},{}\n", nanoseconds(sample.utime), xyz(sample.gyro_B),
             xyz(sample.accel_B));
}

void AslWriter::write(const DepthSample& sample) {
  fmt::print(impl_->rows[kDepth], "{},{:.9g}\n", nanoseconds(sample.utime), sample.depth_m);
}

void AslWriter::write(const AslTruth& truth) {
  const Eigen::Quaterniond& q = truth.X_WB.q;
  fmt::print(impl_->rows[kTruth], "{},{},{:.9g},{:.9g},{:.9g},{:.9g},{},{},{}\n",
             nanoseconds(truth.utime), xyz(truth.X_WB.p), q.w(), q.x(), q.y(), q.z(),
             xyz(truth.v_W), xyz(truth.gyro_bias_B), xyz(truth.accel_bias_B));
}

tl::expected<void, std::string> AslWriter::close() {
  std::string lost = impl_->lost;
  for (std::size_t i = 0; i < kSensors; ++i) {
    impl_->rows[i].close();
    if (!impl_->rows[i] && lost.empty()) lost = (impl_->root / kFolders[i] / "data.csv").string();
  }
  if (lost.empty()) return {};
  return tl::unexpected(fmt::format("{}: cannot be written (disk full?)", lost));
}

}  // namespace dive::mission
