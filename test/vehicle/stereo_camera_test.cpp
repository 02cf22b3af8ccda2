#include "vehicle/simulator/cameras/stereo_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "estimation/visual_inertial/tags/tag_detector.h"
#include "vehicle/simulator/water/named_waters.h"

namespace dive::vehicle {
namespace {

using planning::Box;
using planning::HalfSpace;
using planning::World;

constexpr int kWidth = 376;
constexpr int kHeight = 240;

Pose at(double x, double y, double z, double yaw = 0.0, double pitch = 0.0) {
  return {Eigen::Vector3d(x, y, z), from_rpy(0, pitch, yaw)};
}

// Water without effect, a sensor without noise, half the resolution; white is 200.
StereoCameraOptions exact() {
  StereoCameraOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.fx = options.fy = 120.0;
  options.cx = 187.5;
  options.cy = 119.5;
  options.spectrum = {0.0, 1.0, 0.0};
  options.water = {};
  options.water.beam = options.water.veil = options.water.backscatter = Bands::Zero();
  options.water.lamp_backscatter = options.water.downwelling = Bands::Zero();
  options.water.halo_per_m = options.water.caustics = options.water.snow_per_m3 = 0.0;
  options.sensor.automatic = false;
  options.sensor.vignetting = options.sensor.read_noise = 0.0;
  options.sensor.shot_noise = false;
  options.sensor.electrons_per_ms = 10'000.0;
  options.sensor.exposure_ms = 200.0 / 255.0;
  return options;
}

World floor_at(double z) { return {{{"floor", HalfSpace{Eigen::Vector3d::UnitZ()}, at(0, 0, z)}}}; }

int grey(const ImageFrame& frame, int u, int v) {
  return frame.pixels[static_cast<std::size_t>(v * frame.width + u)];
}

double mean(const ImageFrame& frame) {
  double sum = 0.0;
  for (const std::uint8_t pixel : frame.pixels) sum += pixel;
  return sum / static_cast<double>(frame.pixels.size());
}

ImageFrame left(const World& world, const StereoCameraOptions& options, const Pose& X_WB) {
  StereoCamera camera(world, options, 1);
  return *camera.take(0, X_WB)[0];
}

// Direction of a pixel in B, by angles; without distortion.
Eigen::Vector3d ray(const StereoCameraOptions& o, double u, double v) {
  const double tilt = deg_to_rad(o.tilt_deg);
  const double to_left = (o.cx - u) / o.fx;
  const double up = (o.cy - v) / o.fy;
  return Eigen::Vector3d(std::cos(tilt) + up * std::sin(tilt), to_left,
                         up * std::cos(tilt) - std::sin(tilt))
      .normalized();
}

// The edges of a crate that faces the cameras, compared with CameraModel, which is tested on its
// own; the vehicle is pitched up by the tilt of the cameras.
TEST(StereoCamera, EdgesLieWhereTheCameraModelHasThem) {
  const World world{{{"crate", Box{{1.0, 1.2, 0.8}}, at(3.5, 0.1, -5)}}};
  std::vector<StereoCameraOptions> lenses(5, exact());
  lenses[1].radtan = {-0.08, 0.01, 0.002, -0.001};
  lenses[2].lens = LensModel::kEquidistant;
  lenses[2].lens_parameters = {0.02, -0.01, 0.003, 0.0};
  lenses[3].lens = LensModel::kEucm;
  lenses[3].lens_parameters = {0.6, 1.1};
  lenses[4].lens = LensModel::kDoubleSphere;
  lenses[4].lens_parameters = {-0.2, 0.6};
  for (StereoCameraOptions& options : lenses) {
    options.sensor.exposure_ms *= 5.0;
    const Pose X_WB = at(0, 0, -5, 0, deg_to_rad(-40));
    StereoCamera camera(world, options, 1);
    const StereoFrames frames = camera.take(0, X_WB);
    std::array<double, 2> left_edges{};
    for (std::size_t k = 0; k < 2; ++k) {
      const CameraModel model = options.camera(static_cast<int>(k));
      const Pose X_CW = (X_WB * model.X_BC).inverse();
      const double lens_z = (X_WB * model.X_BC).p.z();
      const auto edge_u = [&](double y) {  // of the face at x = 3, at the height of the lens
        return model.project(X_CW * Eigen::Vector3d(3.0, y, lens_z));
      };
      const Eigen::Vector2d from = *edge_u(0.7);
      const Eigen::Vector2d to = *edge_u(-0.5);
      const int row = static_cast<int>(std::lround(from.y()));
      int first = kWidth;
      int last = -1;
      for (int u = 0; u < kWidth; ++u) {
        if (grey(*frames[k], u, row) < 10) continue;
        first = std::min(first, u);
        last = std::max(last, u);
      }
      EXPECT_NEAR(first - 0.5, from.x(), 0.8) << k;  // including 0.5 for the pixel
      EXPECT_NEAR(last + 0.5, to.x(), 0.8) << k;
      left_edges[k] = first;
    }
    if (&options != &lenses.front()) continue;
    const double depth = 3.0 - 0.31 * std::cos(deg_to_rad(40));
    EXPECT_NEAR(left_edges[0] - left_edges[1], 120.0 * 0.14 / depth, 1.0);
  }
}

TEST(StereoCamera, IsDarkOutsideTheImageOfAFisheye) {
  StereoCameraOptions options = exact();
  options.lens = LensModel::kEquidistant;
  options.fx = options.fy = 0.4 * kHeight;  // 85 degrees off the axis at 0.59 of the height
  const ImageFrame image = left(floor_at(-6.0), options, at(0, 0, -5));
  const CameraModel model = options.camera(0);
  int lit = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const bool has_ray = std::hypot(u - model.cx, v - model.cy) < deg_to_rad(85.0) * model.fx;
      lit += has_ray && grey(image, u, v) > 0 ? 1 : 0;
      if (has_ray) continue;
      EXPECT_EQ(grey(image, u, v), 0) << u << ", " << v;
    }
  }
  EXPECT_GT(lit, kWidth * kHeight / 4);
}

TEST(StereoCamera, IsMountedAtTheBowAndPointsDown) {
  const StereoCameraOptions options;
  EXPECT_LT((options.camera(0).X_BC.p - Eigen::Vector3d(0.31, 0.07, 0)).norm(), 1e-12);
  EXPECT_LT((options.camera(1).X_BC.p - Eigen::Vector3d(0.31, -0.07, 0)).norm(), 1e-12);
  const Eigen::Matrix3d R = options.camera(0).X_BC.q.toRotationMatrix();
  EXPECT_LT((R.col(0) - Eigen::Vector3d(0, -1, 0)).norm(), 1e-12);  // right
  EXPECT_NEAR(rad_to_deg(std::asin(-R(2, 2))), 40.0, 1e-9);
  EXPECT_LT(R(2, 1), 0.0);  // y of C is down
  EXPECT_NEAR(2.0 * rad_to_deg(std::atan(240.0 / 240.0)), 90.0, 1e-9);
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sa += a[i];
    sb += b[i];
    saa += a[i] * a[i];
    sbb += b[i] * b[i];
    sab += a[i] * b[i];
  }
  return (sab - sa * sb / n) / std::sqrt((saa - sa * sa / n) * (sbb - sb * sb / n));
}

double bilinear(const ImageFrame& f, const Eigen::Vector2d& p) {
  const int u = static_cast<int>(std::floor(p.x()));
  const int v = static_cast<int>(std::floor(p.y()));
  const double a = p.x() - u;
  const double b = p.y() - v;
  return (1 - b) * ((1 - a) * grey(f, u, v) + a * grey(f, u + 1, v)) +
         b * ((1 - a) * grey(f, u, v + 1) + a * grey(f, u + 1, v + 1));
}

// Points of a floor, observed from two poses; and, as a reference for the difference, beside their
// expected pixels.
TEST(StereoCamera, TextureIsFixedToTheWorld) {
  const World world = floor_at(-6);
  const StereoCameraOptions options = exact();
  const CameraModel model = options.camera(0);
  const Pose here = at(10, -20, -4.5, 0.3);
  const Pose there = at(10.15, -20.2, -4.55, 0.5);
  const ImageFrame a = left(world, options, here);
  const ImageFrame b = left(world, options, there);
  std::vector<double> seen_here, seen_there, beside;
  for (double x = -2; x < 3; x += 0.03) {
    for (double y = -2; y < 2; y += 0.03) {
      const Eigen::Vector3d p_W(11.2 + x, -19.6 + y, -6);
      const auto pa = model.project((here * model.X_BC).inverse() * p_W);
      const auto pb = model.project((there * model.X_BC).inverse() * p_W);
      if (!pa || !pb || !model.in_image(*pa, 2) || !model.in_image(*pb, 16)) continue;
      seen_here.push_back(bilinear(a, *pa));
      seen_there.push_back(bilinear(b, *pb));
      beside.push_back(bilinear(b, *pb + Eigen::Vector2d(12, 9)));
    }
  }
  ASSERT_GT(seen_here.size(), 3000U);
  EXPECT_GT(correlation(seen_here, seen_there), 0.95);
  EXPECT_LT(correlation(seen_here, beside), 0.6);
}

// A floor far below: a motion of a tenth of a pixel must change the image by a tenth of its
// gradient. Texture finer than a pixel would give a different image each time.
TEST(StereoCamera, TextureDoesNotAlias) {
  const StereoCameraOptions options = exact();
  const double height = 15.0;
  const ImageFrame a = left(floor_at(-20), options, at(0, 0, -20 + height, 0, deg_to_rad(50)));
  const ImageFrame b =
      left(floor_at(-20), options, at(0, 0.1 * height / 120.0, -20 + height, 0, deg_to_rad(50)));
  double differences = 0.0;
  double gradients = 0.0;
  for (int v = 40; v < 200; ++v) {
    for (int u = 80; u < 300; ++u) {
      differences += std::pow(grey(a, u, v) - grey(b, u, v), 2);
      gradients += std::pow(grey(a, u + 1, v) - grey(a, u, v), 2);
    }
  }
  EXPECT_GT(gradients / (160 * 220), 1.0);
  EXPECT_LT(differences, 0.1 * gradients);  // mostly rounding to whole grey values
}

TEST(StereoCamera, SeabedAndWreckDoNotLookAlike) {
  const Pose over = at(0, 0, -3, 0, deg_to_rad(50));
  const World sand{{{"seabed/link/ground", Box{{40, 40, 1}}, at(0, 0, -5.5)}}};
  const World hull{{{"hull/link/deck", Box{{40, 40, 1}}, at(0, 0, -5.5)}}};
  EXPECT_GT(std::abs(mean(left(sand, exact(), over)) - mean(left(hull, exact(), over))), 8.0);
  EXPECT_EQ(mean(left({}, exact(), over)), 0.0);
}

// The same floor through clear water and through water that absorbs in one band, imaged by a sensor
// for that band.
TEST(StereoCamera, LightFallsByBeerAndLambertInEachBand) {
  const Pose X_WB = at(0, 0, -4);
  for (int band = 0; band < 3; ++band) {
    StereoCameraOptions options = exact();
    options.spectrum = Bands::Zero();
    options.spectrum[band] = 1.0;
    options.sensor.exposure_ms *= 2.0;
    const ImageFrame clear = left(floor_at(-6), options, X_WB);
    options.water.beam = {0.2, 0.2, 0.2};
    options.water.beam[band] = 0.35;
    const ImageFrame dim = left(floor_at(-6), options, X_WB);
    options.water.beam.setZero();
    options.water.downwelling[band] = 0.2;
    const ImageFrame deep = left(floor_at(-6), options, X_WB);
    int compared = 0;
    for (int v = 60; v < kHeight; v += 3) {
      for (int u = 0; u < kWidth; u += 3) {
        const double sink = -ray(options, u, v).z();
        const double bright = grey(clear, u, v);
        if (sink < 0.3 || bright < 60 || bright > 250) continue;
        ASSERT_NEAR(grey(dim, u, v), bright * std::exp(-0.35 * 2.0 / sink), 1.2);
        ASSERT_NEAR(grey(deep, u, v), bright * std::exp(-0.2 * 6.0), 1.2);
        ++compared;
      }
    }
    EXPECT_GT(compared, 1000);
  }
}

// Only water in front of the camera: the equation for rays of infinite length.
TEST(StereoCamera, OpenWaterIsVeilAlone) {
  StereoCameraOptions options = exact();
  options.water.veil = {0.3, 0.25, 0.3};
  options.water.backscatter = {0.1, 0.2, 0.1};
  options.water.downwelling = {0.2, 0.1, 0.2};
  const ImageFrame observed = left({}, options, at(0, 0, -10));
  for (int v = 0; v < kHeight; v += 20) {
    const double up = ray(options, 187, v).z();
    if (up > 0.0) continue;  // the ray ends at the water's surface
    const double radiance = 0.2 * std::exp(-0.1 * 10.0) / (0.25 - 0.1 * up);
    ASSERT_NEAR(grey(observed, 187, v), 200.0 * radiance, 1.0) << v;
  }
}

TEST(StereoCamera, WithoutLampsNightIsBlack) {
  StereoCameraOptions options = exact();
  options.water.daylight = Bands::Zero();
  options.tilt_deg = 0.0;
  const World wall{{{"wall", Box{{1, 40, 40}}, at(0, 0, -30)}}};
  EXPECT_EQ(mean(left(wall, options, at(-2.31 - 0.5, 0, -30))), 0.0);

  // One lamp at the lens: the light on a wall falls with the square of the distance.
  options.lamps = {{options.left_B, Eigen::Vector3d::UnitX(), 2.0, 60.0}};
  const auto brightness = [&](double distance) {
    const ImageFrame frame = left(wall, options, at(-0.5 - 0.31 - distance, 0, -30));
    double sum = 0.0;
    for (int v = 70; v < 170; ++v) {
      for (int u = 130; u < 246; ++u) sum += grey(frame, u, v);
    }
    return sum / (100 * 116);
  };
  const double near = brightness(1.5);
  EXPECT_GT(near, 20.0);
  EXPECT_NEAR(brightness(3.0) / near, 0.25, 0.05);

  // In scattering water the beam itself is visible.
  options.water.lamp_backscatter = Bands::Constant(0.05);
  options.lamps.front().p_B.y() += 0.2;
  EXPECT_GT(mean(left({}, options, at(0, 0, -30))), 2.0);
}

// In the open, under a deck, and at the edge of the deck.
TEST(StereoCamera, ItIsDarkUnderADeck) {
  World world = floor_at(-10);
  world.obstacles.push_back({"deck", Box{{12, 12, 0.2}}, at(0, 0, -7)});
  const double open = mean(left(world, exact(), at(12, 0, -9, 0, deg_to_rad(50))));
  const double under = mean(left(world, exact(), at(0, 0, -9, 0, deg_to_rad(50))));
  EXPECT_GT(open, 30.0);
  EXPECT_LT(under, 0.2 * open);
}

std::size_t lit(const ImageFrame& frame) {
  return static_cast<std::size_t>(
      std::count_if(frame.pixels.begin(), frame.pixels.end(), [](auto p) { return p > 4; }));
}

TEST(StereoCamera, SnowDriftsWithTheWater) {
  StereoCameraOptions options = exact();
  options.water.snow_per_m3 = 40.0;
  options.water.snow_radius_m = 0.0015;
  options.water.snow_speed = 0.0;
  const Pose X_WB = at(0, 0, -3);
  StereoCamera camera({}, options, 1);
  const ImageFrame first = *camera.take(0, X_WB)[0];
  EXPECT_GT(lit(first), 50U);
  EXPECT_LT(lit(first), 5000U);
  EXPECT_EQ(camera.take(1'000'000, X_WB)[0]->pixels, first.pixels);
  // In the image of a vehicle that moves with the water the snow is at rest; in another's it is
  // not.
  camera.set_current({0.1, 0.2, 0.0});
  const ImageFrame adrift = *camera.take(2'000'000, at(0.1, 0.2, -3))[0];
  std::size_t same = 0;
  for (std::size_t i = 0; i < first.pixels.size(); ++i) {
    same += first.pixels[i] > 4 && std::abs(first.pixels[i] - adrift.pixels[i]) <= 2 ? 1U : 0U;
  }
  EXPECT_GT(same, lit(first) * 9 / 10);
  EXPECT_NE(camera.take(2'000'000, X_WB)[0]->pixels, first.pixels);
}

TEST(StereoCamera, SameSeedSameImages) {
  StereoCameraOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.lamps = bow_lamps();
  StereoCamera a(floor_at(-6), options, 7);
  StereoCamera b(floor_at(-6), options, 7);
  StereoCamera c(floor_at(-6), options, 8);
  for (int k = 0; k < 4; ++k) {
    const Pose X_WB = at(0.02 * k, 0, -4, 0.01 * k);
    const StereoFrames frames = a.take(50'000 * k, X_WB, at(2, 0, -5));
    const StereoFrames again = b.take(50'000 * k, X_WB, at(2, 0, -5));
    const StereoFrames other = c.take(50'000 * k, X_WB, at(2, 0, -5));
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(frames[i]->pixels, again[i]->pixels);
      EXPECT_NE(frames[i]->pixels, other[i]->pixels);
      EXPECT_EQ(frames[i]->camera, static_cast<int>(i));
      EXPECT_EQ(frames[i]->utime, 50'000 * k);
    }
    EXPECT_NE(frames[0]->pixels, frames[1]->pixels);
    if (k == 2) {
      StereoCamera moved(std::move(b));
      b = std::move(moved);
    }
  }
}

TEST(StereoCamera, RendersTheDiver) {
  const World world = floor_at(-6);
  StereoCamera camera(world, exact(), 1);
  const ImageFrame alone = *camera.take(0, at(0, 0, -4))[0];
  const Eigen::Vector3d where(2.0, 0.1, -5.0);
  const ImageFrame both = *camera.take(0, at(0, 0, -4), at(2.0, 0.1, -5.0, 0.6))[0];
  const CameraModel model = exact().camera(0);
  const auto pixel = model.project((at(0, 0, -4) * model.X_BC).inverse() * where);
  int before = 0;
  int now = 0;
  for (int v = static_cast<int>(pixel->y()) - 8; v < pixel->y() + 8; ++v) {
    for (int u = static_cast<int>(pixel->x()) - 8; u < pixel->x() + 8; ++u) {
      before += grey(alone, u, v);
      now += grey(both, u, v);
    }
  }
  EXPECT_LT(now, before / 2);  // neoprene
  EXPECT_EQ(grey(both, 5, 235), grey(alone, 5, 235));
}

// After ln 2 of the lag the exposure has changed by half, in powers of two. It becomes dark when
// the vehicle is 10 m farther down a slope.
TEST(StereoCamera, ExposureFollowsTheLightWithALag) {
  const HalfSpace slope{Eigen::Vector3d(0.1, 0.0, 1.0).normalized()};
  const World world{{{"slope", slope, at(0, 0, -6)}}};
  StereoCameraOptions options = exact();
  options.water.downwelling[1] = std::log(4.0) / 10.0;
  options.sensor = {};
  options.sensor.read_noise = 0.0;
  options.sensor.lag_s = 0.5;
  StereoCamera camera(world, options, 1);
  const Pose bright_WB = at(0, 0, -4, 0, deg_to_rad(45));
  for (int k = 0; k < 40; ++k) static_cast<void>(camera.take(k * 50'000, bright_WB));
  const double before = mean(*camera.take(2'000'000, bright_WB)[0]);
  EXPECT_NEAR(before / 255.0, 0.35, 0.02);
  const double bright_ms = camera.exposure().ms;
  const Pose dark_WB = at(100, 0, -14, 0, deg_to_rad(45));
  const double dark = mean(*camera.take(2'050'000, dark_WB)[0]);
  EXPECT_NEAR(camera.exposure().ms / bright_ms, 1.0, 0.01);
  ASSERT_LT(dark, 0.5 * before);
  std::vector<double> shares;  // of the change that restores the brightness, in powers of two
  for (int k = 2; k < 60; ++k) {
    static_cast<void>(camera.take(2'000'000 + k * 50'000, dark_WB));
    const double product = camera.exposure().ms * camera.exposure().gain;
    shares.push_back(std::log(product / bright_ms) / std::log(before / dark));
  }
  EXPECT_LT(shares[2], 0.42);
  EXPECT_NEAR(shares[6], 0.5, 0.12);  // 0.35 s after the first dark image
  EXPECT_NEAR(shares.back(), 1.0, 0.05);

  options.water.daylight = Bands::Zero();  // saturates at its limits
  camera = StereoCamera(world, options, 1);
  static_cast<void>(camera.take(0, dark_WB));
  EXPECT_EQ(camera.exposure().ms, options.sensor.longest_ms);
  EXPECT_EQ(camera.exposure().gain, options.sensor.highest_gain);
}

// Photon transfer: the variance of a grey value as a function of its mean.
TEST(StereoCamera, NoiseIsAsStated) {
  StereoCameraOptions options = exact();
  options.sensor.shot_noise = true;
  options.sensor.full_well = 2'000.0;
  options.sensor.electrons_per_ms = 2'000.0;
  options.sensor.read_noise = 30.0;
  options.water.veil = Bands::Constant(1.0);
  options.water.backscatter = Bands::Constant(0.5);  // open water of uniform brightness
  StereoCamera camera({}, options, 3);
  const ImageFrame frame = *camera.take(0, at(0, 0, -10))[0];
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (int v = 60; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      sum += grey(frame, u, v);
      squares += std::pow(grey(frame, u, v), 2);
      count += 1.0;
    }
  }
  const double average = sum / count;
  EXPECT_NEAR(average, 100.0, 1.0);
  const double electrons = 0.5 * 2000.0 * 200.0 / 255.0;
  const double grey_per_electron = 255.0 / 2000.0;
  const double expected = (electrons + 900.0) * grey_per_electron * grey_per_electron + 1.0 / 12.0;
  EXPECT_NEAR((squares / count - average * average) / expected, 1.0, 0.05);
}

TEST(StereoCamera, Faults) {
  StereoCamera camera(floor_at(-6), exact(), 1);
  const auto pose = [](int k) { return at(0.1 * k, 0, -4); };
  const ImageFrame first = *camera.take(0, pose(0))[0];
  camera.set_fault(0, CameraFault::kFrozen);
  const StereoFrames frozen = camera.take(50'000, pose(1));
  EXPECT_EQ(frozen[0]->pixels, first.pixels);
  EXPECT_EQ(frozen[0]->utime, 50'000);
  EXPECT_GT(mean(*frozen[1]), 10.0);
  camera.set_fault(0, CameraFault::kMissing);
  camera.set_fault(1, CameraFault::kBlackout);
  const StereoFrames none = camera.take(100'000, pose(2));
  EXPECT_FALSE(none[0]);
  EXPECT_EQ(mean(*none[1]), 0.0);
  camera.set_fault(0, CameraFault::kBlur);
  camera.set_fault(1, CameraFault::kNone);
  const ImageFrame blurred = *camera.take(150'000, pose(0))[0];
  EXPECT_NEAR(mean(blurred), mean(first), 1.0);
  const auto sharpness = [](const ImageFrame& f) {
    double sum = 0.0;
    for (std::size_t i = 1; i < f.pixels.size(); ++i) {
      sum += std::pow(f.pixels[i] - f.pixels[i - 1], 2);
    }
    return sum;
  };
  EXPECT_LT(sharpness(blurred), 0.1 * sharpness(first));
  camera.set_fault(0, CameraFault::kNone);
  EXPECT_EQ(camera.take(200'000, pose(0))[0]->pixels, first.pixels);
}

TEST(StereoCamera, IsBlackInsideASolidAndRendersTheSkyThroughTheSurface) {
  EXPECT_EQ(mean(left(floor_at(-6), exact(), at(0, 0, -6.1))), 0.0);
  StereoCameraOptions options = exact();
  const ImageFrame up = left({}, options, at(0, 0, -2, 0, deg_to_rad(-130)));
  EXPECT_EQ(grey(up, 187, 119), 200);  // straight up
  EXPECT_LT(grey(up, 5, 119), 10);     // beyond Snell's window
}

TEST(StereoCamera, FallsDueAtItsRate) {
  StereoCameraOptions options = exact();
  options.width = options.height = 32;
  StereoCamera camera({}, options, 1);
  int pairs = 0;
  for (Utime now = 0; now < 10'000'000; now += 10'000) {
    if (!camera.due(now)) continue;
    static_cast<void>(camera.take(now, at(0, 0, -5)));
    EXPECT_FALSE(camera.due(now));
    ++pairs;
  }
  EXPECT_EQ(pairs, 200);
}

TEST(StereoCamera, RefusesOptionsThatMakeNoCamera) {
  EXPECT_EQ(StereoCameraOptions{}.validate(), "");
  for (const WaterOptics& water : {clear_pool(), coastal_sea(), green_lake(), dark_wreck()}) {
    EXPECT_EQ(water.validate(), "");
  }
  for (const Lamp& lamp : bow_lamps()) EXPECT_EQ(lamp.validate(), "");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [](auto change, const std::string& word) {
    StereoCameraOptions options;
    change(options);
    EXPECT_NE(options.validate().find(word), std::string::npos) << options.validate();
  };
  refuses([](auto& o) { o.width = 0; }, "image");
  refuses([](auto& o) { o.fx = -1; }, "focal");
  refuses([nan](auto& o) { o.tilt_deg = nan; }, "tilt_deg");
  refuses([](auto& o) { o.rate_hz = 0; }, "rate_hz");
  refuses([nan](auto& o) { o.left_B.x() = nan; }, "place");
  refuses([](auto& o) { o.spectrum[1] = -1; }, "spectrum");
  refuses([nan](auto& o) { o.water.beam[2] = nan; }, "beam.blue");
  refuses([](auto& o) { o.water.halo_sigma_px = 100; }, "halo_sigma_px");
  refuses([](auto& o) { o.water.snow_per_m3 = 1e6; }, "snow_per_m3");
  refuses([](auto& o) { o.sensor.longest_ms = 1e-3; }, "shortest_ms");
  refuses([](auto& o) { o.sensor.full_well = 0; }, "full_well");
  refuses([](auto& o) { o.lamps = {{{}, Eigen::Vector3d::Zero(), 1, 45}}; }, "direction");
  refuses([](auto& o) { o.lamps = {{{}, {1, 0, 0}, -1, 45}}; }, "power");
}

// In each water type a tag 1.5 m away is decoded correctly, with its corners where the camera model
// puts them.
TEST(StereoCamera, TagsAreReadThroughTheWater) {
  Tag tag;
  tag.id = 42;
  tag.size_m = 0.4;
  tag.X_WT.p = {1.6, 0.1, -5.9};
  tag.X_WT.q = tag_attitude(std::acos(-1.0), 0.5, 0.1);
  const Pose X_WB = at(0, 0, -5, 0.05);
  for (const std::string& water : water_names()) {
    StereoCameraOptions options = *stereo_camera_in(water);
    options.tags = {tag};
    StereoCamera camera(floor_at(-6.6), options, 1);
    const StereoFrames frames = camera.take(0, X_WB);
    for (std::size_t k = 0; k < 2; ++k) {
      const CameraModel model = options.camera(static_cast<int>(k));
      estimation::TagDetector detector(model, {});
      const auto observed = detector.find(*frames[k]);
      ASSERT_EQ(observed.size(), 1U) << water;
      EXPECT_EQ(observed[0].id, 42);
      const Pose X_CT = (X_WB * model.X_BC).inverse() * tag.X_WT;
      const double signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector3d p_C = X_CT * Eigen::Vector3d(0.2 * signs[i][0], 0.2 * signs[i][1], 0);
        const Eigen::Vector2d off = observed[0].corners[i] - p_C.head<2>() / p_C.z();
        EXPECT_LT(model.fx * off.norm(), 1.0) << water << " corner " << i;
      }
    }
  }
}

TEST(StereoCamera, ATagIsPrintedOnOneSideOnly) {
  Tag tag;
  tag.id = 42;
  tag.size_m = 0.4;
  tag.X_WT.p = {1.6, 0.1, -5.9};
  StereoCameraOptions options = exact();
  for (const bool is_front : {true, false}) {
    tag.X_WT.q = tag_attitude(is_front ? std::acos(-1.0) : 0.0, is_front ? 0.5 : -0.5, 0.0);
    options.tags = {tag};
    const ImageFrame frame = left(floor_at(-8), options, at(0, 0, -5));
    estimation::TagDetector detector(options.camera(0), {});
    EXPECT_EQ(detector.find(frame).size(), is_front ? 1U : 0U);
  }
}

}  // namespace
}  // namespace dive::vehicle
