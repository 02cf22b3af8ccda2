// Every lens model against OpenCV or the formulas as published, and the laws that all obey.

#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <rapidcheck/gtest.h>

#include "common/camera_model.h"

namespace dive {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

CameraModel camera(int width, int height, double fx, double fy, double cx, double cy) {
  CameraModel model;
  model.width = width;
  model.height = height;
  model.fx = fx;
  model.fy = fy;
  model.cx = cx;
  model.cy = cy;
  return model;
}

// The left camera of EuRoC.
CameraModel radtan4() {
  CameraModel model = camera(752, 480, 458.654, 457.296, 367.215, 248.375);
  model.radtan = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  return model;
}

CameraModel radtan5() {
  CameraModel model = camera(640, 480, 535.4, 539.2, 320.1, 247.6);
  model.radtan = {-0.2637, 0.0367, 0.0018, -0.0003, 0.0141};
  return model;
}

// A wide angle in the rational form: 100 degrees across.
CameraModel radtan8() {
  CameraModel model = camera(1280, 720, 607.3, 607.1, 638.3, 366.9);
  model.radtan = {0.5247, -2.7254, 0.0005, -0.0002, 1.5723, 0.4017, -2.5417, 1.4931};
  return model;
}

// The left camera of TUM-VI, 512 x 512.
CameraModel equidistant() {
  CameraModel model = camera(512, 512, 190.97847715128717, 190.9733070521226, 254.93170605935475,
                             256.8974428996504);
  model.lens = LensModel::kEquidistant;
  model.lens_parameters = {0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202,
                           0.00020293673591811182};
  return model;
}

// 120 x 90 degrees at 1600 x 1200.
CameraModel eucm() {
  CameraModel model = camera(1600, 1200, 780.0, 781.0, 805.2, 596.4);
  model.lens = LensModel::kEucm;
  model.lens_parameters = {0.61, 1.08};
  return model;
}

// A lens of the paper by Usenko et al., at a quarter of its resolution.
CameraModel double_sphere() {
  CameraModel model = camera(320, 240, 78.3, 78.3, 159.2, 118.6);
  model.lens = LensModel::kDoubleSphere;
  model.lens_parameters = {-0.18, 0.59};
  return model;
}

// Kalibr's omni: the unified model, then radial-tangential distortion.
CameraModel omni() {
  CameraModel model = camera(752, 480, 350.0, 351.0, 370.0, 235.0);
  model.lens = LensModel::kEucm;
  model.lens_parameters = {0.6, 1.0};
  model.radtan = {-0.04, 0.012, 0.0006, -0.0004};
  return model;
}

std::vector<CameraModel> all() {
  return {radtan4(), radtan5(), radtan8(), equidistant(), eucm(), double_sphere(), omni()};
}

CameraModel behind_port(CameraModel model, double index) {
  model.refractive_index = index;
  return model;
}

// And behind flat ports in fresh water and in the sea.
std::vector<CameraModel> with_ports() {
  std::vector<CameraModel> models = all();
  models.push_back(behind_port(radtan4(), 1.333));
  models.push_back(behind_port(equidistant(), 1.341));
  models.push_back(behind_port(double_sphere(), 1.341));
  return models;
}

// Directions in front of the camera whose pixels are in the image.
std::vector<Vector3d> rays_of(const CameraModel& model) {
  std::vector<Vector3d> rays;
  for (double theta = 0.0; theta < 1.4; theta += 0.05) {
    for (double turn = 0.0; turn < 6.28; turn += 0.3) {
      const Vector3d ray(std::sin(theta) * std::cos(turn), std::sin(theta) * std::sin(turn),
                         std::cos(theta));
      const auto pixel = model.project(2.5 * ray);
      if (pixel && model.in_image(*pixel)) rays.push_back(2.5 * ray);
    }
  }
  return rays;
}

double largest_angle(const std::vector<Vector3d>& rays) {
  double angle = 0.0;
  for (const Vector3d& ray : rays) angle = std::max(angle, std::acos(ray.z() / ray.norm()));
  return angle;
}

std::vector<Vector2d> by_opencv(const CameraModel& model, const std::vector<Vector3d>& rays) {
  std::vector<cv::Point3d> points;
  for (const Vector3d& ray : rays) points.emplace_back(ray.x(), ray.y(), ray.z());
  const cv::Matx33d K(model.fx, 0, model.cx, 0, model.fy, model.cy, 0, 0, 1);
  const cv::Vec3d none(0, 0, 0);
  std::vector<cv::Point2d> pixels;
  if (model.lens == LensModel::kEquidistant) {
    const auto& k = model.lens_parameters;
    cv::fisheye::projectPoints(points, pixels, none, none, K, cv::Vec4d(k[0], k[1], k[2], k[3]));
  } else {
    const std::vector<double> k(model.radtan.begin(), model.radtan.end());
    cv::projectPoints(points, none, none, K, k, pixels);
  }
  std::vector<Vector2d> result;
  for (const cv::Point2d& pixel : pixels) result.emplace_back(pixel.x, pixel.y);
  return result;
}

TEST(LensModel, RadialTangentialAndEquidistantAreOpenCvs) {
  for (const CameraModel& model : {radtan4(), radtan5(), radtan8(), equidistant()}) {
    const auto rays = rays_of(model);
    ASSERT_GT(rays.size(), 100U);
    const auto expected = by_opencv(model, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      EXPECT_LT((*model.project(rays[i]) - expected[i]).norm(), 1e-9) << rays[i].transpose();
    }
  }
  EXPECT_GT(largest_angle(rays_of(equidistant())), 1.3);
}

// Equation (4) of Khomutenko et al., of a point with its z.
Vector2d published_eucm(double alpha, double beta, const Vector3d& p) {
  const double rho = std::sqrt(beta * (p.x() * p.x() + p.y() * p.y()) + p.z() * p.z());
  const double below = alpha * rho + (1 - alpha) * p.z();
  return {p.x() / below, p.y() / below};
}

// Equations (40) to (42) of Usenko et al.
Vector2d published_double_sphere(double xi, double alpha, const Vector3d& p) {
  const double d1 = std::sqrt(p.x() * p.x() + p.y() * p.y() + p.z() * p.z());
  const double d2 =
      std::sqrt(p.x() * p.x() + p.y() * p.y() + (xi * d1 + p.z()) * (xi * d1 + p.z()));
  const double below = alpha * d2 + (1 - alpha) * (xi * d1 + p.z());
  return {p.x() / below, p.y() / below};
}

TEST(LensModel, EucmAndDoubleSphereAreThePublishedOnes) {
  for (const CameraModel& model : {eucm(), double_sphere()}) {
    const auto rays = rays_of(model);
    ASSERT_GT(rays.size(), 100U);
    EXPECT_GT(largest_angle(rays), deg_to_rad(60.0));
    for (const Vector3d& ray : rays) {
      const auto [a, b, c, d] = model.lens_parameters;
      const Vector2d m = model.lens == LensModel::kEucm ? published_eucm(a, b, ray)
                                                        : published_double_sphere(a, b, ray);
      const Vector2d expected(model.fx * m.x() + model.cx, model.fy * m.y() + model.cy);
      EXPECT_LT((*model.project(ray) - expected).norm(), 1e-9) << ray.transpose();
    }
  }
}

// The unified model with xi on a sphere of radius 1, then OpenCV's distortion: Mei and Rives 2007.
TEST(LensModel, OmniIsEucmWithDistortion) {
  const CameraModel model = omni();
  const double xi = 0.6 / (1.0 - 0.6);
  for (const Vector3d& ray : rays_of(model)) {
    const Vector3d on_sphere = ray.normalized();
    const Vector2d m = on_sphere.head<2>() / (on_sphere.z() + xi) * (1.0 + xi);
    CameraModel plane = model;
    plane.lens = LensModel::kPinhole;
    const Vector2d expected = by_opencv(plane, {m.homogeneous()}).front();
    EXPECT_LT((*model.project(ray) - expected).norm(), 1e-9);
  }
}

// Snell's law along the ray's azimuth, by the angles: a ray that the lens sees at an angle theta in
// the air came through the water at asin(sin(theta) / index).
TEST(LensModel, SeesRaysBehindAFlatPortAsSnellRefractsThem) {
  for (const CameraModel& in_air : {radtan4(), equidistant(), double_sphere()}) {
    constexpr double kIndex = 1.34;
    const CameraModel model = behind_port(in_air, kIndex);
    EXPECT_EQ(model.validate(), "");
    for (const Vector3d& ray : rays_of(in_air)) {
      const double theta = std::atan2(ray.head<2>().norm(), ray.z());
      const double azimuth = std::atan2(ray.y(), ray.x());
      const double in_water = std::asin(std::sin(theta) / kIndex);
      const Vector3d refracted(std::sin(in_water) * std::cos(azimuth),
                               std::sin(in_water) * std::sin(azimuth), std::cos(in_water));
      const auto pixel = model.project(7.0 * refracted);
      ASSERT_TRUE(pixel) << ray.transpose();
      EXPECT_LT((*pixel - *in_air.project(ray)).norm(), 1e-9) << ray.transpose();
    }
  }
  const CameraModel wide = behind_port(double_sphere(), 1.34);
  EXPECT_FALSE(wide.project({1.2, 0.0, 1.0})) << "50 degrees: beyond total reflection at 48";
}

RC_GTEST_PROP(LensModel, UndoesItsOwnDistortion, ()) {
  for (const CameraModel& model : with_ports()) {
    RC_ASSERT(model.validate() == "");
    const Vector2d n(*rc::gen::inRange(-8000, 8000) * 1e-3, *rc::gen::inRange(-8000, 8000) * 1e-3);
    const auto pixel = model.project(n.homogeneous());
    if (!pixel || !model.in_image(*pixel)) continue;
    RC_ASSERT((*pixel - model.distort(n)).norm() < 1e-12);
    const auto back = model.undistort(*pixel);
    RC_ASSERT(back.has_value());
    RC_ASSERT((*back - n).norm() < 1e-9 * (1.0 + n.squaredNorm()));
  }
}

RC_GTEST_PROP(LensModel, EveryPixelHasItsRay, ()) {
  for (const CameraModel& model : all()) {
    const Vector2d pixel(*rc::gen::inRange(0, model.width), *rc::gen::inRange(0, model.height));
    const auto n = model.undistort(pixel);
    if (!n) {  // beyond the image of the cone of 85 degrees
      const Vector2d centre(model.cx, model.cy);
      const Vector2d direction = (pixel - centre).normalized();
      RC_ASSERT((pixel - centre).norm() > (model.distort(11.4 * direction) - centre).norm());
      RC_ASSERT(model.lens == LensModel::kEquidistant || model.lens == LensModel::kDoubleSphere);
      continue;
    }
    RC_ASSERT((model.distort(*n) - pixel).norm() < 1e-7);
  }
}

RC_GTEST_PROP(LensModel, HasTheJacobianOfItsIntrinsicsThatDifferencesGive, ()) {
  for (const CameraModel& model : with_ports()) {
    const Vector2d pixel(*rc::gen::inRange(0, model.width), *rc::gen::inRange(0, model.height));
    const auto n = model.undistort(pixel);
    if (!n || n->norm() > 4.0) continue;
    const auto J = model.intrinsics_jacobian(*n);
    double CameraModel::*const members[] = {&CameraModel::fx, &CameraModel::fy, &CameraModel::cx,
                                            &CameraModel::cy, &CameraModel::refractive_index};
    for (int i = 0; i < 5; ++i) {
      // An index of 1 has no rays beyond: only the ports have the column of the index here.
      if (i == 4 && model.refractive_index == 1.0) continue;
      const double step = i == 4 ? 1e-7 : 1e-4;
      CameraModel more = model;
      CameraModel less = model;
      more.*members[i] += step;
      less.*members[i] -= step;
      const Vector2d numeric = (more.distort(*n) - less.distort(*n)) / (2.0 * step);
      RC_ASSERT((J.col(i) - numeric).norm() < 1e-4 * (1.0 + numeric.norm()));
    }
  }
}

RC_GTEST_PROP(LensModel, HasTheJacobianThatDifferencesGive, ()) {
  for (const CameraModel& model : with_ports()) {
    const Vector2d pixel(*rc::gen::inRange(0, model.width), *rc::gen::inRange(0, model.height));
    const auto n = model.undistort(pixel);
    if (!n) continue;
    const double step = 1e-6 * (1.0 + n->norm());
    Eigen::Matrix2d numeric;
    for (int i = 0; i < 2; ++i) {
      Vector2d e = Vector2d::Zero();
      e[i] = step;
      numeric.col(i) = (model.distort(*n + e) - model.distort(*n - e)) / (2.0 * step);
    }
    const Eigen::Matrix2d J = model.jacobian(*n);
    RC_ASSERT((J - numeric).cwiseAbs().maxCoeff() < 1e-5 * model.fx);
    RC_ASSERT(J.determinant() > 0.0);
  }
}

TEST(LensModel, HasAJacobianOnTheAxisAndAFocalLengthThere) {
  for (const CameraModel& model : all()) {
    const double pixels = (model.distort({1e-6, 1e-6}) - model.distort({-1e-6, -1e-6})).norm();
    EXPECT_NEAR(model.focal(), pixels / (std::sqrt(8.0) * 1e-6), 1e-2 * model.fx);
    EXPECT_TRUE(model.jacobian(Vector2d::Zero()).allFinite());
  }
}

TEST(LensModel, GivesNoRayFarOffTheAxis) {
  const CameraModel model = equidistant();
  EXPECT_TRUE(model.project({8.0, 0.0, 1.0}));
  EXPECT_FALSE(model.project({12.0, 0.0, 1.0}));
  EXPECT_FALSE(model.undistort({model.cx + 1.6 * model.fx, model.cy}));
  EXPECT_FALSE(model.undistort({std::nan(""), model.cy}));
  // Beyond the circle that a double sphere images at all.
  EXPECT_FALSE(double_sphere().undistort({1000.0, 118.0}));
}

}  // namespace
}  // namespace dive
