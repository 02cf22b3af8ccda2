#include "estimation/visual_inertial/tags/tag_fix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/visual_inertial/filter/feature_update.h"
#include "estimation/visual_inertial/loop_closure/pose_graph.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Vector10d = Eigen::Matrix<double, 10, 1>;
using Matrix10d = Eigen::Matrix<double, 10, 10>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;
using Matrix810d = Eigen::Matrix<double, 8, 10>;

constexpr int kVehicle = 4;
constexpr int kTag = 6;
constexpr int kMaxSteps = 60;
constexpr int kMaxHalvings = 12;
constexpr double kSettled = 1e-6;      // m and rad, of a step
constexpr double kLikelyAsWell = 9.0;  // cost difference below which solutions are equally likely
constexpr double kElsewhere = 1.0;     // chi-square by which such solutions are different places
constexpr double kMaxHeadingSigma =
    0.06;                       // rad, one sigma: possible positions about a tag form an arc
constexpr double kLying = 0.2;  // horizontal part of its normal; less is a tag on the ground
constexpr double kLetGo = 2.0;  // [A C; C^T B] <= [2 A, 0; 0, 2 B]

Pose moved(const Pose& pose, const Vector3d& p, const Vector3d& turn_W) {
  return {pose.p + p, (so3_exp(turn_W) * pose.q).normalized()};
}

// The vehicle pose mirrored about the tag's normal, from the left of it to the right or back. For a
// tag on the ground: unchanged.
Pose leaning_back(const Pose& X_WB, const Pose& X_WT, const Pose& X_BC) {
  const Eigen::Vector2d normal = -(X_WT.q * Vector3d::UnitZ()).head<2>();
  const Eigen::Vector2d observation = ((X_WB * X_BC).p - X_WT.p).head<2>();
  if (normal.norm() < kLying) return X_WB;
  const double bearing = std::atan2(normal.x() * observation.y() - normal.y() * observation.x(),
                                    normal.dot(observation));
  const Eigen::Quaterniond turn = so3_exp({0.0, 0.0, -2.0 * bearing});
  return {X_WT.p + turn * (X_WB.p - X_WT.p), (turn * X_WB.q).normalized()};
}

// Priority of a result among several in one image, by its need for attention.
int weight(TagResult result) {
  switch (result) {
    case TagResult::kNone:
      return 0;
    case TagResult::kUsed:
      return 1;
    case TagResult::kMisshapen:
      return 2;
    case TagResult::kAmbiguous:
      return 3;
    case TagResult::kUnknown:
      return 4;
    case TagResult::kTwice:
      return 5;
    case TagResult::kRefused:
      return 6;
  }
  return 0;
}

}  // namespace

std::string TagFixOptions::validate() const {
  RangeCheck check;
  check("corner_sigma_px", corner_sigma_px, 0.01, 10.0);
  check("misshapen_px", misshapen_px, 0.1, 100.0);
  check("gate_sigma", gate_sigma, 1.0, 10.0);
  check("apart_s", apart_s, 0.0, 100.0);
  return check.problem();
}

std::optional<TagView> view_tag(const Pose& X_WB, const Pose& X_WT, double size_m,
                                const Pose& X_BC) {
  const Matrix3d R_CB = X_BC.q.conjugate().toRotationMatrix();
  const Matrix3d R_CW = R_CB * X_WB.q.conjugate().toRotationMatrix();
  const std::array<Vector3d, 4> corners = tag_corners(size_m);
  TagView view;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector3d arm_W = X_WT.q * corners[k];
    const Vector3d ray_W = X_WT.p + arm_W - X_WB.p;
    const Vector3d h = R_CW * ray_W - R_CB * X_BC.p;
    if (!(h.z() > 0.01)) return std::nullopt;
    const auto row = static_cast<Eigen::Index>(2 * k);
    Eigen::Matrix<double, 2, 3> E;
    E << 1.0 / h.z(), 0.0, -h.x() / (h.z() * h.z()), 0.0, 1.0 / h.z(), -h.y() / (h.z() * h.z());
    const Eigen::Matrix<double, 2, 3> by_point = E * R_CW;
    const Eigen::Matrix<double, 2, 3> by_turn = by_point * skew(ray_W);
    view.z.segment<2>(row) = h.head<2>() / h.z();
    view.by_vehicle.block<2, 3>(row, 0) = -by_point;
    view.by_vehicle.block<2, 1>(row, 3) = by_turn.col(2);
    view.by_tilt.middleRows<2>(row) = by_turn.leftCols<2>();
    view.by_tag.block<2, 3>(row, 0) = by_point;
    view.by_tag.block<2, 3>(row, 3) = -by_point * skew(arm_W);
  }
  return view;
}

/// The most likely errors of vehicle and tag, given prior and observation.
struct TagFix::Solution {
  Vector10d error = Vector10d::Zero();
  Matrix810d H = Matrix810d::Zero();
  Matrix8d S = Matrix8d::Zero();
  Vector8d weighed = Vector8d::Zero();             // S^-1 of the innovation
  double cost = 0.0;                               // chi-square of eight: prior and corners
  Eigen::Matrix4d left = Eigen::Matrix4d::Zero();  // posterior covariance of the vehicle
};

/// The corners as measured, normalised, and what their errors come from.
struct TagFix::Corners {
  Vector8d z = Vector8d::Zero();
  Matrix8d noise = Matrix8d::Zero();  // covariance of z by the noise of a pixel
  Matrix2d tilt = Matrix2d::Zero();   // covariance of the vehicle's roll and pitch, about x, y of W
};

TagFix::TagFix(std::vector<Tag> tags, const CameraModel& camera, const TagFixOptions& options)
    : camera_(camera), options_(options) {
  DIVE_DEMAND(options_.validate().empty() && camera_.validate().empty());
  const int size = kVehicle + kTag * static_cast<int>(tags.size());
  P_ = MatrixXd::Zero(size, size);
  for (Tag& tag : tags) {
    const bool is_new = std::none_of(tags_.begin(), tags_.end(),
                                     [&](const Known& known) { return known.tag.id == tag.id; });
    DIVE_DEMAND(is_new && tag.size_m > 0.0 && tag.sigma_m > 0.0 && tag.sigma_deg > 0.0);
    const auto at = static_cast<Eigen::Index>(kVehicle + kTag * tags_.size());
    P_.diagonal().segment<3>(at).setConstant(tag.sigma_m * tag.sigma_m);
    P_.diagonal().segment<3>(at + 3).setConstant(std::pow(deg_to_rad(tag.sigma_deg), 2));
    tags_.push_back({tag, std::nullopt});
  }
}

void TagFix::restart() { begins_anew_ = has_fix_; }

// The published estimate contains the fixes, and so does a filter initialised from it. The
// correlation of its errors with those of the tags is unknown: both covariances are inflated.
void TagFix::carry_to(const StateEstimate& filter) {
  const int tags = static_cast<int>(P_.rows()) - kVehicle;
  const Eigen::Matrix4d now = position_and_heading(filter.covariance, filter.X_WB.q);
  if (!has_fix_ || begins_anew_) {
    correction_ = {};
    P_.topLeftCorner<kVehicle, kVehicle>() = begins_anew_ ? Eigen::Matrix4d(kLetGo * now) : now;
    P_.topRightCorner(kVehicle, tags).setZero();
    P_.bottomLeftCorner(tags, kVehicle).setZero();
    if (begins_anew_) P_.bottomRightCorner(tags, tags) *= kLetGo;
    begins_anew_ = false;
  } else {
    const StateEstimate there = correction_.apply(filter);
    const Eigen::Matrix4d F = carried(there.X_WB.p - vehicle().p);
    P_.topLeftCorner<kVehicle, kVehicle>() = position_and_heading(there.covariance, there.X_WB.q);
    P_.topRightCorner(kVehicle, tags) = F * P_.topRightCorner(kVehicle, tags);
    P_.bottomLeftCorner(tags, kVehicle) = P_.topRightCorner(kVehicle, tags).transpose();
  }
  correction_.utime = filter.utime;
  correction_.filter = filter.X_WB;
  correction_.filter_covariance = now;
  correction_.covariance = P_.topLeftCorner<kVehicle, kVehicle>();
}

StateEstimate TagFix::apply(const StateEstimate& filter) const {
  // A re-initialised filter is in W until a tag corrects it.
  return has_fix_ && !begins_anew_ ? correction_.apply(filter) : filter;
}

TagObservation TagFix::add(const StateEstimate& filter, std::span<const DetectedTag> detected) {
  carry_to(filter);
  TagObservation worst;
  for (const DetectedTag& tag : detected) {
    const auto known = std::find_if(tags_.begin(), tags_.end(),
                                    [&](const Known& k) { return k.tag.id == tag.id; });
    const auto observations = std::count_if(detected.begin(), detected.end(),
                                            [&](const DetectedTag& s) { return s.id == tag.id; });
    TagObservation observation{tag.id, TagResult::kUnknown, 0.0};
    if (known != tags_.end() && observations > 1) {
      observation.result = TagResult::kTwice;
    } else if (known != tags_.end()) {
      const auto index = static_cast<int>(known - tags_.begin());
      observation = add_one(filter, *known, kVehicle + kTag * index, tag);
    }
    if (weight(observation.result) > weight(worst.result)) worst = observation;
  }
  return worst;
}

// Gauss-Newton on both (Bell and Cathey 1993, "The iterated Kalman filter update as a Gauss-Newton
// method"), from the given initial value; a step that increases the cost is halved.
std::optional<TagFix::Solution> TagFix::solve(const Known& known, int at, const Corners& measured,
                                              Solution from) const {
  Matrix10d P;
  P << P_.topLeftCorner<kVehicle, kVehicle>(), P_.block(0, at, kVehicle, kTag),
      P_.block(at, 0, kTag, kVehicle), P_.block(at, at, kTag, kTag);
  const Eigen::LLT<Matrix10d> before(P);
  if (before.info() != Eigen::Success) return std::nullopt;
  const auto view_at = [&](const Vector10d& x) {
    return view_tag(moved(vehicle(), x.head<3>(), {0.0, 0.0, x[3]}),
                    moved(known.tag.X_WT, x.segment<3>(4), x.tail<3>()), known.tag.size_m,
                    camera_.X_BC);
  };
  const auto noise = [&](const TagView& view) {
    return Matrix8d(measured.noise + view.by_tilt * measured.tilt * view.by_tilt.transpose());
  };
  const auto cost = [&](const Vector10d& x, const TagView& view, const Matrix8d& R) {
    const Vector8d r = measured.z - view.z;
    return x.dot(before.solve(x)) + r.dot(R.llt().solve(r));
  };

  Solution result = std::move(from);
  std::optional<TagView> view = view_at(result.error);
  if (!view) return std::nullopt;
  Matrix8d R = noise(*view);
  result.cost = cost(result.error, *view, R);
  for (int step = 0; step < kMaxSteps; ++step) {
    result.H << view->by_vehicle, view->by_tag;
    result.S = result.H * P * result.H.transpose() + R;
    const Eigen::LLT<Matrix8d> llt(result.S);
    if (llt.info() != Eigen::Success) return std::nullopt;
    result.weighed = llt.solve(measured.z - view->z + result.H * result.error);
    Vector10d by = P * result.H.transpose() * result.weighed - result.error;
    if (!by.allFinite()) return std::nullopt;
    if (by.cwiseAbs().maxCoeff() < kSettled) {
      const Eigen::Matrix<double, 8, 4> HP = result.H * P.leftCols<kVehicle>();
      result.left = P.topLeftCorner<4, 4>() - HP.transpose() * llt.solve(HP);
      return result;
    }
    for (int halving = 0; halving < kMaxHalvings; ++halving, by *= 0.5) {
      const Vector10d there = result.error + by;
      const auto view_there = view_at(there);
      if (!view_there) continue;
      const Matrix8d R_there = noise(*view_there);
      const double cost_there = cost(there, *view_there, R_there);
      if (cost_there > result.cost && by.cwiseAbs().maxCoeff() > kSettled) continue;
      result.error = there;
      result.cost = cost_there;
      view = view_there;
      R = R_there;
      break;
    }
  }
  return std::nullopt;
}

TagFix::Corners TagFix::corners_of(const StateEstimate& filter, const DetectedTag& detected) const {
  Corners corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto row = static_cast<Eigen::Index>(2 * k);
    const Matrix2d per_pixel = camera_.jacobian(detected.corners[k]).inverse();
    corners.z.segment<2>(row) = detected.corners[k];
    corners.noise.block<2, 2>(row, row) =
        options_.corner_sigma_px * options_.corner_sigma_px * per_pixel * per_pixel.transpose();
  }
  const Matrix3d R_WF = vehicle().q.toRotationMatrix();
  corners.tilt =
      (R_WF * filter.covariance.bottomRightCorner<3, 3>() * R_WF.transpose()).topLeftCorner<2, 2>();
  return corners;
}

// Starts from the present estimate, from the vehicle pose of either pose of the square, and from
// that of the likeliest of these mirrored. Returns the likeliest first.
std::vector<TagFix::Solution> TagFix::solve_all(const StateEstimate& filter, const Known& known,
                                                int at, const DetectedTag& detected,
                                                std::span<const Pose> poses_WB) const {
  const Corners measured = corners_of(filter, detected);
  std::vector<Solution> found;
  const auto begin_at = [&](const Pose& X_WB) {
    Solution begin;
    begin.error.head<3>() = X_WB.p - vehicle().p;
    begin.error[3] = to_rpy(X_WB.q * vehicle().q.conjugate()).z();
    if (auto solution = solve(known, at, measured, std::move(begin))) found.push_back(*solution);
  };
  const auto likelier = [](const Solution& a, const Solution& b) { return a.cost < b.cost; };
  begin_at(vehicle());
  for (const Pose& X_WB : poses_WB) begin_at(X_WB);
  std::sort(found.begin(), found.end(), likelier);
  if (found.empty()) return found;
  const Vector10d x = found.front().error;
  begin_at(leaning_back(moved(vehicle(), x.head<3>(), {0.0, 0.0, x[3]}),
                        moved(known.tag.X_WT, x.segment<3>(4), x.tail<3>()), camera_.X_BC));
  std::sort(found.begin(), found.end(), likelier);
  return found;
}

TagResult TagFix::check(std::span<const Solution> found) const {
  if (found.empty()) return TagResult::kRefused;
  const Solution& best = found.front();
  const Eigen::Vector4d off = best.error.head<4>();
  const Eigen::LLT<Eigen::Matrix4d> before(P_.topLeftCorner<kVehicle, kVehicle>());
  const bool is_credible = best.cost <= chi_square_limit(options_.gate_sigma, 8) &&
                           before.info() == Eigen::Success &&
                           off.dot(before.solve(off)) <= chi_square_limit(options_.gate_sigma, 4);
  if (!is_credible) return TagResult::kRefused;
  const Eigen::LDLT<Eigen::Matrix4d> after(best.left);
  const bool is_ambiguous = std::any_of(found.begin(), found.end(), [&](const Solution& other) {
    const Eigen::Vector4d away = other.error.head<4>() - off;
    return other.cost - best.cost < kLikelyAsWell && away.dot(after.solve(away)) > kElsewhere;
  });
  const bool is_bent = best.left(3, 3) > kMaxHeadingSigma * kMaxHeadingSigma;
  return is_ambiguous || is_bent ? TagResult::kAmbiguous : TagResult::kUsed;
}

TagObservation TagFix::add_one(const StateEstimate& filter, Known& known, int at,
                               const DetectedTag& detected) {
  TagObservation observation{known.tag.id, TagResult::kNone, 0.0};
  const bool is_news = !known.used || to_seconds(filter.utime - *known.used) >= options_.apart_s;
  if (!is_news) return observation;
  const std::vector<TagPose> poses = tag_poses(detected, known.tag.size_m);
  const double scale = std::sqrt(camera_.jacobian(detected.corners[0]).determinant());
  if (poses.empty() || poses.front().error * scale > options_.misshapen_px) {
    observation.result = TagResult::kMisshapen;
    return observation;
  }
  std::vector<Pose> poses_WB;
  poses_WB.reserve(poses.size());
  for (const TagPose& pose : poses) {
    poses_WB.push_back(known.tag.X_WT * pose.X_CT.inverse() * camera_.X_BC.inverse());
  }
  observation.correction_m = (poses_WB.front().p - vehicle().p).head<2>().norm();
  const std::vector<Solution> found = solve_all(filter, known, at, detected, poses_WB);
  observation.result = check(found);
  if (observation.result != TagResult::kUsed) return observation;
  observation.correction_m = found.front().error.head<2>().norm();
  known.used = filter.utime;
  correct(found.front(), at, filter.X_WB);
  return observation;
}

void TagFix::correct(const Solution& solution, int at, const Pose& filter) {
  MatrixXd HP = solution.H.leftCols<kVehicle>() * P_.topRows<kVehicle>() +
                solution.H.rightCols<kTag>() * P_.middleRows(at, kTag);
  const Eigen::VectorXd error = HP.transpose() * solution.weighed;
  const Eigen::LLT<Matrix8d> llt(solution.S);
  llt.matrixL().solveInPlace(HP);
  P_.selfadjointView<Eigen::Lower>().rankUpdate(HP.transpose(), -1.0);
  P_.triangularView<Eigen::StrictlyUpper>() = P_.transpose();
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(kVehicle + kTag * i);
    Pose& X_WT = tags_[i].tag.X_WT;
    X_WT = moved(X_WT, error.segment<3>(column), error.segment<3>(column + 3));
  }
  const Eigen::Quaterniond turn =
      (so3_exp({0.0, 0.0, error[3]}) * correction_.correction.q).normalized();
  correction_.correction = {vehicle().p + error.head<3>() - turn * filter.p, turn};
  correction_.covariance = P_.topLeftCorner<kVehicle, kVehicle>();
  has_fix_ = true;
}

}  // namespace dive::estimation
