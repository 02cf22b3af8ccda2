#include "estimation/dataset/camera_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/estimation/dataset/asl_folder.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

tl::expected<CameraModel, std::string> read(const std::string& text) {
  const std::string path = testing::fresh_folder() + "/sensor.yaml";
  testing::write_text(path, text);
  const auto file = SensorFile::open(path);
  if (!file) return tl::make_unexpected(file.error());
  return read_camera_model(*file);
}

// With the numbers of TUM-VI's left camera, 512 x 512.
constexpr const char* kTumVi =
    "sensor_type: camera\n"
    "T_BS:\n  cols: 4\n  rows: 4\n"
    "  data: [1, 0, 0, 0.045, 0, 1, 0, -0.071, 0, 0, 1, -0.047, 0, 0, 0, 1]\n"
    "rate_hz: 20\n"
    "resolution: [512, 512]\n"
    "camera_model: pinhole\n"
    "intrinsics: [190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504]\n"
    "distortion_model: equidistant\n"
    "distortion_coefficients: [0.0034823894022493434, 0.0007150348452162257, "
    "-0.0020532361418706202, 0.00020293673591811182]\n";

std::string with(std::string text, const std::string& old, const std::string& now) {
  return text.replace(text.find(old), old.size(), now);
}

TEST(CameraCalibration, ReadsTumVi) {
  for (const char* name : {"equidistant", "equi"}) {
    const auto model = read(with(kTumVi, "equidistant", name));
    ASSERT_TRUE(model) << model.error();
    EXPECT_EQ(model->validate(), "");
    EXPECT_EQ(model->lens, LensModel::kEquidistant);
    EXPECT_EQ(model->width, 512);
    EXPECT_EQ(model->lens_parameters[2], -0.0020532361418706202);
    // 60 degrees off the axis: theta_d = theta (1 + k1 theta^2 + ...) = 1.0471976 * 1.0022646.
    const auto pixel = model->project({std::sqrt(3.0), 0.0, 1.0});
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), 254.931706 + 190.978477 * 1.0471976 * 1.0022646, 1e-3);
  }
}

std::string pinhole(const std::string& distortion) {
  return "resolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [500, 501, 320, 240]\n" +
         distortion;
}

TEST(CameraCalibration, ReadsRadialTangentialDistortionWithAllCounts) {
  const auto radtan = [](const std::string& name, const std::string& numbers) {
    const auto model =
        read(pinhole("distortion_model: " + name + "\ndistortion_coefficients: " + numbers));
    EXPECT_TRUE(model) << model.error();
    return model ? model->radtan : std::array<double, 8>{};
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(radtan("none", "[]"), ElementsAre(0, 0, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(radtan("radtan", "[]"), ElementsAre(0, 0, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(radtan("radtan", "[0.1, 0.2, 0.3, 0.4]"),
              ElementsAre(0.1, 0.2, 0.3, 0.4, 0, 0, 0, 0));
  EXPECT_THAT(radtan("plumb_bob", "[0.1, 0.2, 0.3, 0.4, 0.5]"),
              ElementsAre(0.1, 0.2, 0.3, 0.4, 0.5, 0, 0, 0));
  EXPECT_THAT(radtan("rational_polynomial", "[1, 2, 3, 4, 5, 6, 7, 8]"),
              ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_TRUE(read(pinhole("distortion_model: none\n")));
  const auto unnamed = read(pinhole("distortion_coefficients: [0.1, 0.2, 0.3, 0.4]\n"));
  ASSERT_TRUE(unnamed);
  EXPECT_EQ(unnamed->radtan[3], 0.4);
}

// Kalibr's omni-radtan: on a unit sphere, from xi behind its centre, then distorted.
TEST(CameraCalibration, ReadsKalibrsOmni) {
  const auto model = read(
      "resolution: [752, 480]\ncamera_model: omni\n"
      "intrinsics: [1.6, 900.0, 905.0, 370.0, 240.0]\n"
      "distortion_model: radtan\ndistortion_coefficients: [-0.1, 0.3, 0.002, -0.001]\n");
  ASSERT_TRUE(model) << model.error();
  EXPECT_EQ(model->validate(), "");
  const Vector3d ray = Vector3d(0.8, -0.5, 1.0).normalized();
  const double x = ray.x() / (ray.z() + 1.6);
  const double y = ray.y() / (ray.z() + 1.6);
  const double r2 = x * x + y * y;
  const double radial = 1 - 0.1 * r2 + 0.3 * r2 * r2;
  const Eigen::Vector2d expected(
      900 * (x * radial + 2 * 0.002 * x * y - 0.001 * (r2 + 2 * x * x)) + 370,
      905 * (y * radial + 0.002 * (r2 + 2 * y * y) - 2 * 0.001 * x * y) + 240);
  EXPECT_LT((*model->project(ray) - expected).norm(), 1e-9);
}

TEST(CameraCalibration, ReadsKalibrsDoubleSphereAndEucm) {
  const auto sphere = read(
      "resolution: [640, 512]\ncamera_model: ds\n"
      "intrinsics: [-0.18, 0.59, 156.6, 156.7, 319.3, 257.2]\ndistortion_model: none\n"
      "distortion_coefficients: []\n");
  ASSERT_TRUE(sphere) << sphere.error();
  EXPECT_EQ(sphere->lens, LensModel::kDoubleSphere);
  EXPECT_EQ(sphere->lens_parameters[0], -0.18);
  EXPECT_EQ(sphere->lens_parameters[1], 0.59);
  EXPECT_EQ(sphere->fx, 156.6);
  EXPECT_EQ(sphere->cy, 257.2);
  const auto eucm = read(
      "resolution: [640, 512]\ncamera_model: eucm\n"
      "intrinsics: [0.61, 1.08, 190, 191, 320, 256]\n");
  ASSERT_TRUE(eucm) << eucm.error();
  EXPECT_EQ(eucm->lens, LensModel::kEucm);
  EXPECT_EQ(eucm->lens_parameters[1], 1.08);
}

TEST(CameraCalibration, ReportsLineAndWhatIsKnown) {
  const struct {
    std::string text;
    const char* words;
  } bad[] = {
      {with(kTumVi, "pinhole", "mei"),
       "sensor.yaml:8: camera_model is mei; known are pinhole, omni, eucm and ds"},
      {with(kTumVi, "equidistant", "fov"),
       "sensor.yaml:10: distortion_model is fov; known are radial-tangential, radtan, plumb_bob, "
       "rational_polynomial, equidistant, equi and none"},
      {with(kTumVi, "pinhole", "ds"),
       "sensor.yaml:10: distortion_model equidistant belongs to camera_model pinhole, not ds"},
      {with(kTumVi, "equidistant", "none"),
       "sensor.yaml:11: distortion_coefficients must be a list"},
      {with(kTumVi, "0.0034823894022493434, ", ""),
       "sensor.yaml:11: distortion_coefficients must be a list of 4 numbers"},
      {pinhole("distortion_model: radtan\ndistortion_coefficients: [1, 2, 3]\n"),
       "sensor.yaml:5: distortion_coefficients must be a list of 0 or 4 or 5 or 8 numbers"},
      {pinhole("distortion_model: radtan\n"), "there is no distortion_coefficients"},
      {with(kTumVi, "190.97847715128717, ", ""),
       "sensor.yaml:9: intrinsics must be a list of 4 numbers"},
      {with(kTumVi, "[512, 512]", "[512, 0]"), "sensor.yaml:7: an image of 512 x 0 pixels"},
      {"resolution: [640, 480]\ncamera_model: omni\nintrinsics: [-0.5, 500, 501, 320, 240]\n",
       "sensor.yaml:3: xi is -0.5 but must be at least 0"},
      {"resolution: [640, 480]\ncamera_model: eucm\nintrinsics: [500, 501, 320, 240]\n",
       "sensor.yaml:3: intrinsics must be a list of 6 numbers"}};
  for (const auto& [text, words] : bad) {
    const auto model = read(text);
    ASSERT_FALSE(model) << words;
    EXPECT_THAT(model.error(), HasSubstr(words));
  }
}

TEST(CameraCalibration, IsReadAsItIsWritten) {
  CameraModel model;
  model.width = 1600;
  model.height = 1200;
  model.fx = 780.123456789012;
  model.fy = 781.5;
  model.cx = 801.25;
  model.cy = 600.1;
  std::vector<CameraModel> all(5, model);
  all[0].radtan = {-0.1, 0.02, 0.001, -1.0 / 3.0, 0, 0, 0, 0};
  all[1].radtan = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8};
  all[2].lens = LensModel::kEquidistant;
  all[2].lens_parameters = {0.01, -0.02, 0.003, 1.0 / 7.0};
  all[3].lens = LensModel::kEucm;
  all[3].lens_parameters = {0.6, 1.0};
  all[3].radtan = {-0.01, 0.002, 0.0001, 0.0002};  // Kalibr's omni
  all[4].lens = LensModel::kDoubleSphere;
  all[4].lens_parameters = {-0.18, 0.59};
  all[4].refractive_index = 1.3405;
  all[4].line_time_s = 2.5e-5;
  for (const CameraModel& written : all) {
    const auto again = read(camera_model_yaml(written));
    ASSERT_TRUE(again) << again.error();
    EXPECT_EQ(again->width, 1600);
    EXPECT_EQ(again->fx, written.fx);
    EXPECT_EQ(again->cy, written.cy);
    EXPECT_EQ(again->lens, written.lens);
    EXPECT_EQ(again->lens_parameters, written.lens_parameters);
    EXPECT_EQ(again->radtan, written.radtan);
    EXPECT_EQ(again->refractive_index, written.refractive_index);
    EXPECT_EQ(again->line_time_s, written.line_time_s);
  }
}

}  // namespace
}  // namespace dive::estimation
