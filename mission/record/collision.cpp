#include "mission/record/collision.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace dive::mission {
namespace {

std::string describe_place(double t_s, const Eigen::Vector3d& p_W) {
  return fmt::format("at {:.2f} s and ({:.2f}, {:.2f}, {:.2f}) m", t_s, p_W.x(), p_W.y(), p_W.z());
}

}  // namespace

double horizontal_error(const estimation::StateEstimate& estimate, const Pose& true_X_WB) {
  return (estimate.X_WB.p - true_X_WB.p).head<2>().norm();
}

std::vector<Collision> collisions_at(Utime utime, const Pose& true_X_WB,
                                     std::span<const std::string> contacts,
                                     const estimation::StateEstimate& estimate) {
  std::vector<Collision> collisions;
  for (const std::string& obstacle : contacts) {
    Collision collision{to_seconds(utime), true_X_WB.p, obstacle, std::nullopt};
    if (estimate.valid) {
      collision.estimate =
          Collision::Estimate{estimate.X_WB.p, horizontal_error(estimate, true_X_WB),
                              estimation::horizontal_sigma(estimate)};
    }
    collisions.push_back(std::move(collision));
  }
  return collisions;
}

std::vector<std::string> obstacles_of(std::span<const Collision> collisions) {
  std::vector<std::string> obstacles;
  for (const Collision& collision : collisions) obstacles.push_back(collision.obstacle);
  return obstacles;
}

std::string describe(const Collision& collision) {
  const std::string what =
      fmt::format("with '{}' {}", collision.obstacle, describe_place(collision.t_s, collision.p_W));
  if (!collision.estimate) return what + "; no estimate";
  const auto& [p_W, error_m, sigma_m] = *collision.estimate;
  return fmt::format("{}; estimated ({:.2f}, {:.2f}, {:.2f}) m, error {:.2f} m, one sigma {:.2f} m",
                     what, p_W.x(), p_W.y(), p_W.z(), error_m, sigma_m);
}

std::string describe(const NearestApproach& nearest) {
  if (!std::isfinite(nearest.clearance_m)) return "no obstacle";
  return fmt::format("{:.2f} m from '{}' {}", nearest.clearance_m, nearest.obstacle,
                     describe_place(nearest.t_s, nearest.p_W));
}

std::string describe(std::span<const Collision> collisions) {
  constexpr std::size_t kMaxListed = 5;
  if (collisions.empty()) return "";
  std::string text =
      fmt::format("{} collision{}", collisions.size(), collisions.size() == 1 ? ":" : "s:");
  const std::size_t listed = std::min(collisions.size(), kMaxListed);
  for (std::size_t i = 0; i < listed; ++i) {
    text += fmt::format("{} {}", i == 0 ? "" : ";", describe(collisions[i]));
  }
  if (listed < collisions.size()) text += fmt::format("; and {} more", collisions.size() - listed);
  return text;
}

}  // namespace dive::mission
