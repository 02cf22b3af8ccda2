#include "test/estimation/visual_inertial/tags/tag_print.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include "common/random.h"

namespace dive::estimation::testing {
namespace {

constexpr int kWidth = 480;
constexpr int kHeight = 320;
constexpr double kFocal = 240.0;
constexpr double kMiddleX = 239.5;
constexpr double kMiddleY = 159.5;
constexpr int kSamples = 4;  // along each side of a pixel
constexpr double kWall = 110.0;
constexpr double kWhite = 190.0;
constexpr double kBlack = 40.0;

std::vector<std::uint8_t> modules_of(int id) {
  apriltag_family_t* const family = tag36h11_create();
  image_u8_t* const image = apriltag_to_image(family, id);
  std::vector<std::uint8_t> modules;
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x) modules.push_back(image->buf[y * image->stride + x]);
  }
  std::free(image->buf);
  std::free(image);
  tag36h11_destroy(family);
  return modules;
}

}  // namespace

CameraModel tag_camera() {
  CameraModel camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = kFocal;
  camera.cx = kMiddleX;
  camera.cy = kMiddleY;
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.X_BC = {{0.3, 0.07, 0.0}, Eigen::Quaterniond(R_BC)};
  return camera;
}

ImageFrame image_of(const std::vector<Print>& prints, double noise, std::uint64_t seed) {
  Random random(seed);
  std::vector<std::vector<std::uint8_t>> modules;
  for (const Print& print : prints) modules.push_back(modules_of(print.id));
  const auto grey = [&](double u, double v) {
    const Eigen::Vector3d d((u - kMiddleX) / kFocal, (v - kMiddleY) / kFocal, 1.0);
    for (std::size_t i = 0; i < prints.size(); ++i) {
      const Eigen::Matrix3d R = prints[i].X_CT.q.toRotationMatrix();
      const double t = R.col(2).dot(prints[i].X_CT.p) / R.col(2).dot(d);
      const Eigen::Vector3d p = R.transpose() * (t * d - prints[i].X_CT.p);
      const double module = prints[i].size_m / 8.0;
      const double x = std::floor(p.x() / module + 5.0);
      const double y = std::floor(p.y() / module + 5.0);
      if (t <= 0.0 || x < 0.0 || y < 0.0 || x >= 10.0 || y >= 10.0) continue;
      return modules[i][static_cast<std::size_t>(10.0 * y + x)] > 127 ? kWhite : kBlack;
    }
    return kWall;
  };
  ImageFrame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      double sum = 0.0;
      for (int k = 0; k < kSamples * kSamples; ++k) {
        sum += grey(u - 0.5 + (k % kSamples + 0.5) / kSamples,
                    v - 0.5 + (k / kSamples + 0.5) / kSamples);
      }
      const double level = sum / (kSamples * kSamples) + noise * random.normal();
      frame.pixels.push_back(static_cast<std::uint8_t>(std::clamp(level, 0.0, 255.0)));
    }
  }
  return frame;
}

std::vector<Eigen::Vector2d> true_corners(const Print& print) {
  std::vector<Eigen::Vector2d> corners;
  const double h = print.size_m / 2.0;
  for (const auto& [x, y] :
       {std::pair(-h, -h), std::pair(h, -h), std::pair(h, h), std::pair(-h, h)}) {
    const Eigen::Vector3d p =
        print.X_CT.q.toRotationMatrix() * Eigen::Vector3d(x, y, 0.0) + print.X_CT.p;
    corners.emplace_back(kFocal * p.x() / p.z() + kMiddleX, kFocal * p.y() / p.z() + kMiddleY);
  }
  return corners;
}

void blur(ImageFrame& image, int width) {
  const std::vector<std::uint8_t> sharp = image.pixels;
  const int half = width / 2;
  for (int v = half; v < image.height - half; ++v) {
    for (int u = half; u < image.width - half; ++u) {
      int sum = 0;
      for (int dv = -half; dv <= half; ++dv) {
        for (int du = -half; du <= half; ++du) {
          sum += sharp[static_cast<std::size_t>((v + dv) * image.width + u + du)];
        }
      }
      image.pixels[static_cast<std::size_t>(v * image.width + u)] =
          static_cast<std::uint8_t>(sum / ((2 * half + 1) * (2 * half + 1)));
    }
  }
}

}  // namespace dive::estimation::testing
