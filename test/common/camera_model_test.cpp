#include "common/camera_model.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace dive {
namespace {

using ::testing::HasSubstr;

// The calibration of the left camera of the EuRoC sequences.
CameraModel euroc() {
  CameraModel camera;
  camera.width = 752;
  camera.height = 480;
  camera.fx = 458.654;
  camera.fy = 457.296;
  camera.cx = 367.215;
  camera.cy = 248.375;
  camera.radtan = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  return camera;
}

TEST(CameraModel, PutsThePointAheadOnThePrincipalPoint) {
  const auto pixel = euroc().project({0.0, 0.0, 3.0});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 367.215, 1e-9);
  EXPECT_NEAR(pixel->y(), 248.375, 1e-9);
}

// Computed by hand: n = (0.3, -0.2), r^2 = 0.13, radial = 1 - 0.0368430543 + 0.0012499087.
TEST(CameraModel, DistortsByTheFormula) {
  const auto pixel = euroc().project({0.6, -0.4, 2.0});
  ASSERT_TRUE(pixel);
  const double radial = 0.9644068544;
  const double dx = 0.3 * radial + 2 * 0.00019359 * -0.06 + 1.76187114e-05 * (0.13 + 0.18);
  const double dy = -0.2 * radial + 0.00019359 * (0.13 + 0.08) + 2 * 1.76187114e-05 * -0.06;
  EXPECT_NEAR(pixel->x(), 458.654 * dx + 367.215, 1e-6);
  EXPECT_NEAR(pixel->y(), 457.296 * dy + 248.375, 1e-6);
}

RC_GTEST_PROP(CameraModel, UndoesItsOwnDistortionAllOverTheImage, ()) {
  const CameraModel camera = euroc();
  const Eigen::Vector2d pixel(*rc::gen::inRange(0, 752), *rc::gen::inRange(0, 480));
  const auto normalised = camera.undistort(pixel);
  RC_ASSERT(normalised.has_value());
  RC_ASSERT((camera.distort(*normalised) - pixel).norm() < 1e-6);
}

TEST(CameraModel, ProjectsNothingFromBehind) {
  EXPECT_FALSE(euroc().project({0.1, 0.1, -1.0}));
  EXPECT_FALSE(euroc().project({0.1, 0.1, 0.0}));
  EXPECT_FALSE(euroc().project({0.1, 0.1, std::numeric_limits<double>::quiet_NaN()}));
}

TEST(CameraModel, TestsTheBoundsOfTheImage) {
  const CameraModel camera = euroc();
  EXPECT_TRUE(camera.in_image({0.0, 0.0}));
  EXPECT_TRUE(camera.in_image({751.0, 479.0}));
  EXPECT_FALSE(camera.in_image({752.0, 10.0}));
  EXPECT_FALSE(camera.in_image({751.0, 479.0}, 5.0));
}

TEST(CameraModel, ReportsWhatIsWrongWithIt) {
  EXPECT_EQ(euroc().validate(), "");
  CameraModel camera = euroc();
  camera.width = 0;
  EXPECT_THAT(camera.validate(), HasSubstr("0 x 480"));
  camera = euroc();
  camera.fy = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(camera.validate(), HasSubstr("focal"));
  camera = euroc();
  camera.radtan[1] = 1e9;
  EXPECT_THAT(camera.validate(), HasSubstr("distortion"));
  camera = euroc();
  camera.X_BC.p.x() = std::numeric_limits<double>::infinity();
  EXPECT_THAT(camera.validate(), HasSubstr("pose"));
  camera = euroc();
  camera.lens = LensModel::kEucm;
  camera.lens_parameters = {0.6, -1.0};
  EXPECT_THAT(camera.validate(), HasSubstr("beta -1"));
  camera.lens = LensModel::kDoubleSphere;
  camera.lens_parameters = {-0.2, 1.5};
  EXPECT_THAT(camera.validate(), HasSubstr("alpha 1.5"));
  camera.lens_parameters[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(camera.validate(), HasSubstr("lens parameters"));
  camera = euroc();
  camera.refractive_index = 0.75;
  EXPECT_THAT(camera.validate(), HasSubstr("refractive index of 0.75"));
  camera = euroc();
  camera.line_time_s = 0.033;
  EXPECT_THAT(camera.validate(), HasSubstr("line time of 0.033 s"));
}

TEST(CameraModel, ExposesTheMiddleRowAtTheStamp) {
  CameraModel camera = euroc();
  EXPECT_EQ(camera.row_time({0.0, 479.0}), 0.0);
  camera.line_time_s = 4e-5;
  EXPECT_NEAR(camera.row_time({100.0, 0.0}), -239.5 * 4e-5, 1e-12);
  EXPECT_NEAR(camera.row_time({100.0, 479.0}), 239.5 * 4e-5, 1e-12);
}

TEST(CameraModel, ReportsADistortionThatFoldsOverInTheImage) {
  CameraModel camera = euroc();
  camera.radtan = {-0.6, 0.0, 0.0, 0.0};  // folds over at r^2 = 1 / 1.8, before the left edge
  EXPECT_THAT(camera.validate(), HasSubstr("folds over before pixel"));
  camera = euroc();
  camera.lens = LensModel::kEquidistant;
  camera.radtan = {};
  camera.lens_parameters = {0.0, -0.5, 0.0, 0.0};  // at theta^4 = 1 / 2.5
  EXPECT_THAT(camera.validate(), HasSubstr("folds over before pixel"));
}

TEST(CameraModel, DoesNotInventWhereTheImageFoldsOver) {
  CameraModel camera = euroc();
  camera.radtan = {-0.9, 0.0, 0.0, 0.0};  // the distorted image folds over at r^2 = 1 / 2.7
  EXPECT_FALSE(camera.undistort({camera.cx + 2.0 * camera.fx, camera.cy}));
  EXPECT_TRUE(camera.project({0.6, 0.0, 1.0}));
  EXPECT_FALSE(camera.project({1.0, 0.0, 1.0})) << "the formula gives pixel (413, 248)";
}

}  // namespace
}  // namespace dive
