#include "test/planning/random_world.h"

#include <cmath>
#include <random>

#include <fmt/format.h>

#include "planning/world/scene.h"

namespace dive::testing {
namespace {

using Eigen::Vector3d;
using planning::Box;
using planning::Cylinder;
using planning::Polytope;
using planning::Shape;

constexpr double kDepth = -10.0;  // z of the middle
const Vector3d kHalf(8.0, 8.0, 4.0);

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11U) * 0x1p-53;
  }
  Vector3d vector(const Vector3d& half) {
    const double x = (*this)(-half.x(), half.x());
    const double y = (*this)(-half.y(), half.y());
    return {x, y, (*this)(-half.z(), half.z())};
  }
  Eigen::Quaterniond turn() {
    const Vector3d axis = vector(Vector3d::Ones()).normalized();
    return Eigen::Quaterniond(Eigen::AngleAxisd((*this)(0.0, M_PI), axis));
  }

 private:
  std::mt19937_64 engine_;
};

Shape shape(Draw& draw, double size) {
  switch (static_cast<int>(draw(0.0, 3.0))) {
    case 0:
      return Box{Vector3d(draw(0.1, 1.0), draw(0.1, 1.0), draw(0.1, 1.0)) * size};
    case 1: {
      const double radius = draw(0.05, 0.5);
      return Cylinder{radius, draw(0.5, 3.0) * size};
    }
    default: {
      Polytope hull;
      const int points = 4 + static_cast<int>(draw(0.0, 12.0));
      for (int i = 0; i < points; ++i) {
        hull.vertices.push_back(draw.vector(Vector3d::Constant(size / 2.0)));
      }
      hull.radius = 1e-6;
      return hull;
    }
  }
}

}  // namespace

RandomQuestion random_question(std::uint64_t seed, const planning::RobotHull& hull) {
  Draw draw(seed);
  RandomQuestion question;
  const int count = static_cast<int>(5.0 * std::pow(40.0, draw(0.0, 1.0)));
  // The more obstacles the smaller, so that some water stays free.
  const double size = draw(1.0, 5.0) * std::cbrt(60.0 / std::max(count, 20));
  for (int i = 0; i < count; ++i) {
    Pose pose;
    pose.p = draw.vector(kHalf) + Vector3d(0.0, 0.0, kDepth);
    pose.q = draw.turn();
    question.world.obstacles.push_back({fmt::format("o{}", i), shape(draw, size), pose});
  }
  planning::PlanRequest& request = question.request;
  request.limits.clearance = draw(0.1, 0.6);
  request.limits.min_z = kDepth - kHalf.z() - 2.0;
  request.seed = seed;
  planning::Scene scene(question.world);
  const std::vector<Vector3d> vertices = hull.hull_vertices();
  const bool anywhere = draw(0.0, 1.0) < 0.05;
  const auto place = [&](double x, Pose& pose) {
    for (int attempt = 0; attempt < 1000; ++attempt) {
      pose = Pose{};
      pose.p = Vector3d(x, draw(-kHalf.y(), kHalf.y()), kDepth + draw(-kHalf.z(), kHalf.z()));
      std::vector<Vector3d> placed;
      for (const Vector3d& v : vertices) placed.push_back(pose * v);
      if (anywhere || scene.clearance(placed, 1.0) >= request.limits.clearance + 0.05) return;
    }
  };
  place(-kHalf.x() - draw(-2.0, 1.0), request.start);
  place(kHalf.x() + draw(-2.0, 1.0), request.goal);
  return question;
}

}  // namespace dive::testing
