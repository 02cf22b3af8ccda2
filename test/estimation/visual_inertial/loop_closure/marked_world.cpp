#include "test/estimation/visual_inertial/loop_closure/marked_world.h"

#include <cmath>
#include <optional>

namespace dive::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFocal = 240.0;
constexpr double kBaseline = 0.14;
constexpr std::size_t kMost = 160;
constexpr int kWrongBits = 10;

// Projection by hand: x ahead, y to the left, z up, for a camera `y` to the left of B.
std::optional<Vector2d> projected(const Pose& X_WB, double y, const Vector3d& p_W) {
  const Vector3d p = X_WB.q.conjugate() * (p_W - X_WB.p) - Vector3d(0, y, 0);
  if (p.x() < 0.3 || p.norm() > 8.0) return std::nullopt;
  const Vector2d n(-p.y() / p.x(), -p.z() / p.x());
  if (std::abs(n.x()) > 376.0 / kFocal || std::abs(n.y()) > 240.0 / kFocal) return std::nullopt;
  return n;
}

}  // namespace

CameraModel MarkedWorld::camera(int index) {
  CameraModel model;
  model.width = 752;
  model.height = 480;
  model.fx = model.fy = kFocal;
  model.cx = 375.5;
  model.cy = 239.5;
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  model.X_BC = {{0, (index == 0 ? 0.5 : -0.5) * kBaseline, 0}, Eigen::Quaterniond(R_BC)};
  return model;
}

void MarkedWorld::add(int count, const Vector3d& low, const Vector3d& high, Random& random) {
  for (int i = 0; i < count; ++i) {
    Mark mark;
    for (int k = 0; k < 3; ++k) mark.p_W[k] = random.uniform(low[k], high[k]);
    for (auto& word : mark.descriptor) word = random.bits();
    marks_.push_back(mark);
  }
}

void MarkedWorld::repeat(const Vector3d& shift) {
  const std::size_t count = marks_.size();
  for (std::size_t i = 0; i < count; ++i) {
    marks_.push_back({marks_[i].p_W + shift, marks_[i].descriptor});
  }
}

estimation::KeyframeView MarkedWorld::view(Utime utime, const Pose& X_WB, Random& random,
                                           double pixels) const {
  estimation::KeyframeView view;
  view.utime = utime;
  const auto noisy = [&](const Vector2d& n) {
    const double x = random.normal();
    return Vector2d(n + pixels / kFocal * Vector2d(x, random.normal()));
  };
  for (const Mark& mark : marks_) {
    const auto left = projected(X_WB, 0.5 * kBaseline, mark.p_W);
    if (!left || view.points.size() >= kMost) continue;
    estimation::KeyframePoint point;
    point.left = noisy(*left);
    if (const auto right = projected(X_WB, -0.5 * kBaseline, mark.p_W)) point.right = noisy(*right);
    point.descriptor = mark.descriptor;
    for (int i = 0; i < kWrongBits; ++i) {
      const std::uint64_t bit = random.bits() % 256;
      point.descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
    view.points.push_back(point);
  }
  return view;
}

}  // namespace dive::testing
