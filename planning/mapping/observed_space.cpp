#include "planning/mapping/observed_space.h"

#include <algorithm>
#include <cmath>

namespace dive::planning {
namespace {

constexpr double kMovedOn = 0.3;     // m moved since the last stored scan
constexpr double kTurned = 0.25;     // rad turned since the last stored scan
constexpr double kSwimming = 0.05;   // m/s; slower counts as at rest
constexpr float kOffTheBow = 0.9F;   // cosine between bow and motion
constexpr float kAboveFrom = 12.0F;  // heights of the hull: the sensor's view reaches 5 degrees up
constexpr float kStep = 0.2F;        // m
constexpr std::size_t kNewest = 4;   // stored scans used to test whether a ray passed a point

}  // namespace

ObservedSpace::ObservedSpace(const RobotHull& hull) : half_B_(Eigen::Vector3f::Zero()) {
  for (const ConvexSolid& part : hull.parts) {
    for (const Eigen::Vector3d& v : part.vertices) {
      half_B_ = half_B_.cwiseMax(v.cwiseAbs().cast<float>());
    }
  }
}

void ObservedSpace::add(RangeImage image) {
  const bool is_new_place = kept_.empty() ||
                            (kept_.back().X_WB().p - image.X_WB().p).norm() > kMovedOn ||
                            kept_.back().X_WB().q.angularDistance(image.X_WB().q) > kTurned;
  latest_ = std::move(image);
  latest_.forget_points();
  if (!is_new_place) return;
  if (kept_.size() == kMaxScans) kept_.pop_front();
  kept_.push_back(latest_);
}

bool ObservedSpace::was_passed_recently(const Eigen::Vector3f& p_W, float margin) const {
  if (latest_.is_passed(p_W, margin)) return true;
  const std::size_t newest = std::min(kNewest, kept_.size());
  return std::any_of(kept_.end() - static_cast<std::ptrdiff_t>(newest), kept_.end(),
                     [&](const RangeImage& image) { return image.is_passed(p_W, margin); });
}

bool ObservedSpace::is_observed_free(const Eigen::Vector3f& p_W) const {
  const auto is_in_view = [&](const RangeImage& image) { return image.is_in_view(p_W); };
  return is_in_view(latest_) || std::any_of(kept_.rbegin(), kept_.rend(), is_in_view);
}

double ObservedSpace::free_ahead(const Pose& X_WB, const Eigen::Vector3d& v_W) const {
  const Eigen::Matrix3f R_WB = X_WB.q.toRotationMatrix().cast<float>();
  const Eigen::Vector3f bow = R_WB.col(0);
  const Eigen::Vector3f v = v_W.cast<float>();
  const bool leads_elsewhere = v_W.norm() > kSwimming && v.normalized().dot(bow) < kOffTheBow;
  const Eigen::Vector3f direction = leads_elsewhere ? Eigen::Vector3f(v.normalized()) : bow;
  // Half extent of the hull's box in the direction of motion.
  const float lead = (R_WB.transpose() * direction).cwiseAbs().dot(half_B_);
  const Eigen::Vector3f across = R_WB.col(1) * half_B_.y();
  const Eigen::Vector3f up = R_WB.col(2) * half_B_.z();
  const Eigen::Vector3f from = X_WB.p.cast<float>();
  for (float ahead = kStep; ahead <= static_cast<float>(kMaxDistance); ahead += kStep) {
    const Eigen::Vector3f middle = from + (lead + ahead) * direction;
    const bool sees_above = (middle - latest_.origin_W()).norm() > kAboveFrom * half_B_.z();
    for (const Eigen::Vector3f& p :
         {middle, Eigen::Vector3f(middle + across), Eigen::Vector3f(middle - across),
          Eigen::Vector3f(middle - up), sees_above ? Eigen::Vector3f(middle + up) : middle}) {
      if (!is_observed_free(p)) return static_cast<double>(ahead - kStep);
    }
  }
  return kMaxDistance;
}

void ObservedSpace::move(const MapCorrection& correction) {
  latest_.move(correction.at(latest_.utime()) * latest_.X_WB());
  for (RangeImage& image : kept_) image.move(correction.at(image.utime()) * image.X_WB());
}

}  // namespace dive::planning
