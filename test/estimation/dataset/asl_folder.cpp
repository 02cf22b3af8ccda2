#include "test/estimation/dataset/asl_folder.h"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <png.h>

namespace dive::estimation::testing {

namespace fs = std::filesystem;

std::string fresh_folder() {
  const auto* const test = ::testing::UnitTest::GetInstance()->current_test_info();
  const fs::path folder = fs::path(::testing::TempDir()) / "dive-dataset" /
                          (std::string(test->test_suite_name()) + "." + test->name());
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder.string();
}

void write_text(const std::string& path, const std::string& text) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream(path) << text;
}

void write_png(const std::string& path, const ImageFrame& frame) {
  fs::create_directories(fs::path(path).parent_path());
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(frame.width);
  image.height = static_cast<png_uint_32>(frame.height);
  image.format = frame.format == ImageFrame::Format::kGray8 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;
  ASSERT_NE(png_image_write_to_file(&image, path.c_str(), 0, frame.pixels.data(), 0, nullptr), 0);
}

std::string camera_yaml(const CameraModel& camera) {
  const Eigen::Matrix3d R = camera.X_BC.q.toRotationMatrix();
  const Eigen::Vector3d& p = camera.X_BC.p;
  std::string text =
      "# General sensor definitions.\nsensor_type: camera\ncomment: VI-Sensor cam0 (MT9M034)\n\n"
      "# Sensor extrinsics wrt. the body-frame.\nT_BS:\n  cols: 4\n  rows: 4\n  data: [";
  for (int i = 0; i < 3; ++i) {
    text += fmt::format("{}, {}, {}, {},\n         ", R(i, 0), R(i, 1), R(i, 2), p[i]);
  }
  const bool is_equidistant = camera.lens == LensModel::kEquidistant;
  const double* const k = is_equidistant ? camera.lens_parameters.data() : camera.radtan.data();
  return text + fmt::format(
                    "0.0, 0.0, 0.0, 1.0]\n\n# Camera specific definitions.\nrate_hz: 20\n"
                    "resolution: [{}, {}]\ncamera_model: pinhole\n"
                    "intrinsics: [{}, {}, {}, {}] #fu, fv, cu, cv\n"
                    "distortion_model: {}\n"
                    "distortion_coefficients: [{}, {}, {}, {}]\n",
                    camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
                    is_equidistant ? "equidistant" : "radial-tangential", k[0], k[1], k[2], k[3]);
}

std::string imu_yaml() {
  return "#Default imu sensor yaml file\nsensor_type: imu\ncomment: VI-Sensor IMU (ADIS16448)\n\n"
         "# Sensor extrinsics wrt. the body-frame.\nT_BS:\n  cols: 4\n  rows: 4\n"
         "  data: [1.0, 0.0, 0.0, 0.0,\n         0.0, 1.0, 0.0, 0.0,\n"
         "         0.0, 0.0, 1.0, 0.0,\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: 200\n\n"
         "# inertial sensor noise model parameters (static)\n"
         "gyroscope_noise_density: 1.6968e-04     # [ rad / s / sqrt(Hz) ]   ( gyro \"white "
         "noise\" )\n"
         "gyroscope_random_walk: 1.9393e-05       # [ rad / s^2 / sqrt(Hz) ]\n"
         "accelerometer_noise_density: 2.0000e-3  # [ m / s^2 / sqrt(Hz) ]\n"
         "accelerometer_random_walk: 3.0000e-3    # [ m / s^3 / sqrt(Hz) ]\n";
}

}  // namespace dive::estimation::testing
