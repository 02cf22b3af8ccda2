#include "estimation/visual_inertial/filter/landmark_cloud.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/range_check.h"

namespace dive::estimation {
namespace {

// The part of a landmark's covariance that is not the vehicle's.
Eigen::Matrix3d own_covariance(const StateEstimate& estimate, const Landmark& landmark) {
  const Eigen::Matrix3d R_WB = estimate.X_WB.q.toRotationMatrix();
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose << Eigen::Matrix3d::Identity(), -skew(landmark.p_W - estimate.X_WB.p) * R_WB;
  return landmark.covariance - by_pose * estimate.covariance * by_pose.transpose();
}

}  // namespace

std::string LandmarkCloudOptions::validate() const {
  RangeCheck check;
  check("max_landmarks", max_landmarks, 1, 1e7);
  check("noise_m", noise_m, 0, 10);
  check("noise_square", noise_square, 0, 1);
  check("max_age_s", max_age_s, 0, 1e6);
  check("reach_m", reach_m, 0.1, 1000);
  return check.problem();
}

LandmarkCloud::LandmarkCloud(LandmarkCloudOptions options) : options_(options) {
  DIVE_DEMAND(options.validate().empty());
}

void LandmarkCloud::add(const StateEstimate& estimate, std::span<const Landmark> landmarks) {
  for (const Landmark& landmark : landmarks) {
    if (!landmark.p_W.allFinite() || !landmark.covariance.allFinite()) continue;
    const Eigen::Matrix3d own = own_covariance(estimate, landmark);
    if (!own.allFinite()) continue;
    CloudLandmark& kept = landmarks_[landmark.id];
    by_age_.erase({kept.placed, landmark.id});
    kept = {landmark.id,
            landmark.p_W,
            landmark.covariance,
            largest_sigma(own),
            (landmark.p_W - estimate.X_WB.p).norm(),
            estimate.utime};
    by_age_[{kept.placed, landmark.id}] = landmark.id;
  }
  drop_one();
}

void LandmarkCloud::drop_one() {
  while (landmarks_.size() > static_cast<std::size_t>(options_.max_landmarks)) {
    landmarks_.erase(by_age_.begin()->second);
    by_age_.erase(by_age_.begin());
  }
}

void LandmarkCloud::move(const std::function<Pose(Utime)>& correction) {
  for (auto& [id, landmark] : landmarks_) {
    const Pose X = correction(landmark.placed);
    const Eigen::Matrix3d R = X.q.toRotationMatrix();
    landmark.p_W = X * landmark.p_W;
    landmark.covariance = R * landmark.covariance * R.transpose();
  }
}

bool LandmarkCloud::is_good(const CloudLandmark& landmark) const {
  return landmark.sigma_m <=
         options_.noise_m + options_.noise_square * landmark.distance_m * landmark.distance_m;
}

RangeScan LandmarkCloud::scan(Utime utime, const Pose& X_WB, const Eigen::Vector3d& eye_B) const {
  RangeScan scan;
  scan.utime = utime;
  scan.origin_B = eye_B.cast<float>();
  scan.reach = static_cast<float>(options_.reach_m);
  const Pose X_BW = X_WB.inverse();
  const Utime oldest = utime - from_seconds(options_.max_age_s);
  for (auto it = by_age_.lower_bound({oldest, std::numeric_limits<std::int64_t>::min()});
       it != by_age_.end() && scan.points_B.size() < kMaxScanPoints; ++it) {
    const CloudLandmark& landmark = landmarks_.at(it->second);
    const Eigen::Vector3d p_B = X_BW * landmark.p_W;
    if (landmark.placed > utime || !is_good(landmark)) continue;
    // A point beyond the reach would mean that nothing is in the way.
    if ((p_B - eye_B).norm() < (1.0 - 1e-6) * options_.reach_m) {
      scan.points_B.push_back(p_B.cast<float>());
    }
  }
  return scan;
}

std::string LandmarkCloud::to_ply() const {
  const auto count = std::count_if(landmarks_.begin(), landmarks_.end(),
                                   [&](const auto& entry) { return is_good(entry.second); });
  std::string text = fmt::format("ply\nformat ascii 1.0\nelement vertex {}\n", count);
  for (const char* name : {"x", "y", "z", "cxx", "cxy", "cxz", "cyy", "cyz", "czz"}) {
    fmt::format_to(std::back_inserter(text), "property double {}\n", name);
  }
  text += "property int id\nproperty double t\nend_header\n";
  for (const auto& [id, landmark] : landmarks_) {
    if (!is_good(landmark)) continue;
    const Eigen::Vector3d& p = landmark.p_W;
    const Eigen::Matrix3d& C = landmark.covariance;
    fmt::format_to(std::back_inserter(text),
                   "{:.4f} {:.4f} {:.4f} {:.4g} {:.4g} {:.4g} {:.4g} {:.4g} {:.4g} {} {:.6f}\n",
                   p.x(), p.y(), p.z(), C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2), id,
                   to_seconds(landmark.placed));
  }
  return text;
}

}  // namespace dive::estimation
