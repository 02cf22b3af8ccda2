#include "estimation/visual_inertial/filter/visual_update.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include <Eigen/Cholesky>

#include "common/assert.h"

namespace dive::estimation {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A track with fewer observations cannot be told from a drifting particle's: it is used only where
// there are too few others, and two cameras saw it.
constexpr std::size_t kMinObservations = 4;
constexpr std::size_t kMinShortViews = 4;  // in either image, of such a track
constexpr int kMaxRejections = 3;          // consecutive, of a landmark
constexpr int kMaxPromotions = 3;          // new landmarks in one frame
// A landmark's first covariance is linearised where it is triangulated: it must be initialised
// well, when the speed is known.
constexpr double kLandmarkSpeedSigma = 0.01;  // m/s, the largest of an axis
constexpr double kLandmarkDepthShare = 0.03;  // sigma of its depth over the depth
// With a more uncertain speed the rows of a track are nonlinear within the prior's spread, and an
// update counts its prediction's variance this many times more as noise (underweighting: Zanetti,
// DeMars, Bishop, J. Guidance 2010).
constexpr double kUncertainSpeedSigma = 0.02;  // m/s, the largest of an axis
constexpr double kUnderweight = 1.0;
constexpr double kLongestGap_s = 1.0;  // between frames across which features are followed

std::size_t count_views(const FeatureTrack& track) {
  std::size_t count = 0;
  for (const TrackObservation& observation : track.observations) count += observation.right ? 2 : 1;
  return count;
}

// Covariance of p_W = p + R l, with l as triangulated: the triangulation's own, and the vehicle's.
Eigen::Matrix3d with_vehicle(const FilterState& state, const Eigen::Vector3d& p_W,
                             const Eigen::Matrix3d& own) {
  const Kinematics& now = state.imu.motion;
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose << -skew(p_W - now.p_WB) * now.q_WB.toRotationMatrix(), Eigen::Matrix3d::Identity();
  return own + by_pose * state.covariance().topLeftCorner<6, 6>() * by_pose.transpose();
}

}  // namespace

/// A track that passed the gate, with its first three rows separate.
struct VisualUpdate::Gated {
  LinearSystem system;
  Landmark landmark;
  double distance = 0.0;
};

VisualUpdate::VisualUpdate(const VisualInertialOptions& options)
    : options_(options), sigma_(options.pixel_sigma) {}

VisualReport VisualUpdate::apply(FilterState& state, const FeatureFrame& frame, std::int64_t number,
                                 double since_last_s) {
  DIVE_DEMAND(!state.clones().empty() && state.clones().back().frame == number);
  VisualReport report;
  distance_ = freedom_ = 0.0;
  if (since_last_s > kLongestGap_s) end_tracks_before_gap(state, number, report);
  follow(state, frame, number, report);
  correct_landmarks(state, number, report);
  const auto leaving = leaving_clone(state);
  const std::vector<Candidate> found = candidates(state, number, leaving);
  std::vector<std::int64_t> used;
  used.reserve(found.size());
  for (const Candidate& candidate : found) used.push_back(candidate.track->id);
  correct_tracks(state, found, report);
  for (const std::int64_t id : used) tracks_.use_up(id);
  clean(state, number, leaving);
  if (freedom_ > 0.0) report.innovation_ratio = distance_ / freedom_;
  return report;
}

void VisualUpdate::end_tracks_before_gap(FilterState& state, std::int64_t number,
                                         VisualReport& report) {
  correct_tracks(state, candidates(state, number, std::nullopt), report);
  tracks_.clear();
  while (!state.landmarks().empty()) state.drop_landmark(state.landmarks().size() - 1);
  while (state.clones().size() > 1) state.drop_clone(0);
}

void VisualUpdate::follow(const FilterState& state, const FeatureFrame& frame, std::int64_t number,
                          VisualReport& report) {
  landmark_observations_.clear();
  std::set<std::int64_t> seen_ids;
  for (const FeatureObservation& feature : frame.features) {
    const auto observation = observation_of(feature, number, options_.cameras);
    if (!observation || report.followed >= options_.max_features ||
        !seen_ids.insert(feature.id).second) {
      ++report.ignored;
      continue;
    }
    ++report.followed;
    const auto& marks = state.landmarks();
    const auto mark = std::find_if(marks.begin(), marks.end(),
                                   [&](const MapLandmark& m) { return m.id == feature.id; });
    if (mark == marks.end()) {
      tracks_.add(feature.id, *observation);
    } else {
      landmark_observations_.emplace_back(static_cast<std::size_t>(mark - marks.begin()),
                                          *observation);
    }
  }
}

bool VisualUpdate::is_out(const MatrixXd& S, const VectorXd& r, double& distance) const {
  const Eigen::LLT<MatrixXd> llt(S);
  distance = llt.matrixL().solve(r).squaredNorm();
  return llt.info() != Eigen::Success ||
         !(distance <= chi_square_limit(options_.gate_sigma, r.size()));
}

void VisualUpdate::correct_landmarks(FilterState& state, std::int64_t number,
                                     VisualReport& report) {
  if (landmark_observations_.empty()) return;
  const Columns calibration = state.view_columns()[0];
  const Columns clone = state.clone_columns(state.clones().size() - 1);
  const int marks = 3 * static_cast<int>(state.landmarks().size());
  const std::array<Columns, 2> all{{{calibration.start, calibration.size + marks}, clone}};
  MatrixXd H =
      MatrixXd::Zero(static_cast<Eigen::Index>(4 * landmark_observations_.size()), all[0].size + 6);
  VectorXd r(H.rows());
  Eigen::Index rows = 0;
  int used = 0;
  for (const auto& [index, observation] : landmark_observations_) {
    MapLandmark& mark = state.landmarks()[index];
    mark.last_frame = number;
    const Columns own = state.landmark_columns(index);
    const auto system = landmark_system(state, index, observation);
    double distance = 0.0;
    bool is_rejected = !system;
    if (system) {
      const std::array<Columns, 3> columns{{calibration, own, clone}};
      MatrixXd S = state.innovation(columns, system->H);
      S.diagonal().array() += sigma_ * sigma_;
      is_rejected = is_out(S, system->r, distance);
    }
    mark.rejected = is_rejected ? mark.rejected + 1 : 0;
    if (is_rejected) {
      ++report.rejected;
      continue;
    }
    const Eigen::Index count = system->r.size();
    H.block(rows, 0, count, calibration.size) = system->H.leftCols(calibration.size);
    H.block(rows, own.start - calibration.start, count, 3) =
        system->H.middleCols<3>(calibration.size);
    H.block(rows, all[0].size, count, 6) = system->H.rightCols<6>();
    r.segment(rows, count) = system->r;
    rows += count;
    distance_ += distance;
    freedom_ += static_cast<double>(count);
    ++used;
  }
  H.conservativeResize(rows, Eigen::NoChange);
  r.conservativeResize(rows);
  if (!state.correct(all, H, r, VectorXd::Constant(rows, sigma_ * sigma_))) return;
  report.used += used;
  for (const auto& [index, observation] : landmark_observations_) {
    const MapLandmark& mark = state.landmarks()[index];
    if (mark.rejected > 0) continue;
    const int at = state.landmark_columns(index).start;
    report.landmarks.push_back({mark.id, mark.p_W, state.covariance().block<3, 3>(at, at)});
  }
}

// The newest but one, unless it is as far from the one before as kept clones are, or as long after
// it: without the latter a vehicle that hovers would use up all tracks that reach back to the
// oldest.
std::optional<std::size_t> VisualUpdate::leaving_clone(const FilterState& state) const {
  const auto& clones = state.clones();
  if (clones.size() < static_cast<std::size_t>(options_.max_clones)) return std::nullopt;
  const Pose& late = clones[clones.size() - 2].X_WB;
  const Pose& before = clones[clones.size() - 3].X_WB;
  const bool is_far = (late.p - before.p).norm() >= options_.keyframe_distance_m ||
                      rad_to_deg(angle_between(late.q, before.q)) >= options_.keyframe_rotation_deg;
  const Utime apart = clones[clones.size() - 2].utime - clones[clones.size() - 3].utime;
  return is_far || to_seconds(apart) >= options_.keyframe_period_s ? 0 : clones.size() - 2;
}

std::vector<VisualUpdate::Candidate> VisualUpdate::candidates(
    const FilterState& state, std::int64_t number, std::optional<std::size_t> leaving) const {
  std::vector<Candidate> found;
  // A few of the tracks that reach back to the oldest clone are used in every frame, not all of
  // them when it leaves: an unused track then loses one observation, and stays.
  const std::int64_t oldest = state.clones().front().frame;
  for (const auto& [id, track] : tracks_.all()) {
    if (track.observations.empty()) continue;
    const bool is_lost = track.last_frame != number;
    const bool is_long = leaving && track.observations.front().frame == oldest;
    if (!is_lost && !is_long) continue;
    const bool is_short = track.observations.size() < kMinObservations;
    if (is_short && count_views(track) < kMinShortViews) continue;
    found.push_back({&track, !is_lost, is_short});
  }
  // Lost tracks cannot wait.
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    return std::make_tuple(a.is_short, a.may_stay, count_views(*b.track), a.track->id) <
           std::make_tuple(b.is_short, b.may_stay, count_views(*a.track), b.track->id);
  });
  const std::size_t most = static_cast<std::size_t>(options_.max_update_features);
  const auto enough =
      static_cast<std::size_t>(std::ranges::count(found, false, &Candidate::is_short));
  found.resize(std::min({found.size(), most, std::max(enough, most / 2)}));
  return found;
}

std::optional<VisualUpdate::Gated> VisualUpdate::gated(const FilterState& state,
                                                       const FeatureTrack& track,
                                                       VisualReport& report) const {
  const auto place = triangulate(views_of(state, track), sigma_);
  std::optional<LinearSystem> system;
  if (place) system = track_system(state, track, place->p_W);
  if (!system || system->r.size() < 4) {
    ++report.untriangulated;
    return std::nullopt;
  }
  separate_landmark(*system);
  const Eigen::Index free = system->r.size() - 3;
  MatrixXd S = state.innovation(state.view_columns(), system->H.bottomRows(free));
  S.diagonal().array() += sigma_ * sigma_;
  Gated result;
  if (is_out(S, system->r.tail(free), result.distance)) {
    ++report.rejected;
    return std::nullopt;
  }
  result.system = std::move(*system);
  result.landmark = {track.id, place->p_W,
                     with_vehicle(state, place->p_W, sigma_ * sigma_ * place->covariance)};
  return result;
}

void VisualUpdate::correct_tracks(FilterState& state, const std::vector<Candidate>& found,
                                  VisualReport& report) {
  const double speed_variance =
      state.covariance().diagonal().segment<3>(imu_error::kVelocity).maxCoeff();
  int free_places = 0;
  if (speed_variance < kLandmarkSpeedSigma * kLandmarkSpeedSigma) {
    free_places = std::min(kMaxPromotions,
                           options_.max_landmarks - static_cast<int>(state.landmarks().size()));
  }
  std::vector<const FeatureTrack*> staying;
  std::vector<Gated> passed;
  Eigen::Index rows = 0;
  for (const Candidate& candidate : found) {
    auto one = gated(state, *candidate.track, report);
    if (!one) continue;
    if (candidate.may_stay && free_places > 0 &&
        depth_share(state, one->system, one->landmark.p_W, sigma_) < kLandmarkDepthShare) {
      staying.push_back(candidate.track);
      --free_places;
      continue;
    }
    rows += one->system.r.size() - 3;
    passed.push_back(std::move(*one));
  }
  const auto columns = state.view_columns();
  MatrixXd H(rows, columns[0].size + columns[1].size);
  VectorXd r(rows);
  rows = 0;
  for (const Gated& one : passed) {
    const Eigen::Index free = one.system.r.size() - 3;
    H.middleRows(rows, free) = one.system.H.bottomRows(free);
    r.segment(rows, free) = one.system.r.tail(free);
    rows += free;
    distance_ += one.distance;
    freedom_ += static_cast<double>(free);
  }
  compress(H, r);
  VectorXd variances = VectorXd::Constant(r.size(), sigma_ * sigma_);
  if (rows > 0 && speed_variance > kUncertainSpeedSigma * kUncertainSpeedSigma) {
    variances += kUnderweight * state.innovation(columns, H).diagonal();
  }
  if (rows > 0 && state.correct(columns, H, r, variances)) {
    report.used += static_cast<int>(passed.size());
    for (const Gated& one : passed) report.landmarks.push_back(one.landmark);
  }
  const std::int64_t number = state.clones().back().frame;
  for (const FeatureTrack* track : staying) promote(state, *track, number, report);
}

void VisualUpdate::promote(FilterState& state, const FeatureTrack& track, std::int64_t number,
                           VisualReport& report) {
  auto one = gated(state, track, report);
  if (!one) return;
  const LinearSystem& system = one->system;
  const MapLandmark mark{track.id, one->landmark.p_W, number, 0};
  if (!state.add_landmark(mark, system.H.topRows<3>(), system.H_f.topRows<3>(), system.r.head<3>(),
                          sigma_ * sigma_)) {
    return;
  }
  const Eigen::Index free = system.r.size() - 3;
  if (state.correct(state.view_columns(), system.H.bottomRows(free), system.r.tail(free),
                    VectorXd::Constant(free, sigma_ * sigma_))) {
    ++report.used;
    distance_ += one->distance;
    freedom_ += static_cast<double>(free);
    report.landmarks.push_back(one->landmark);
  }
}

void VisualUpdate::clean(FilterState& state, std::int64_t number,
                         std::optional<std::size_t> leaving) {
  for (const MapLandmark& mark : state.landmarks()) tracks_.forget(mark.id);
  tracks_.forget_lost(number);
  if (leaving) {
    tracks_.forget_frame(state.clones()[*leaving].frame);
    state.drop_clone(*leaving);
  }
  for (std::size_t i = state.landmarks().size(); i-- > 0;) {
    const MapLandmark& mark = state.landmarks()[i];
    if (mark.last_frame != number || mark.rejected >= kMaxRejections) state.drop_landmark(i);
  }
}

}  // namespace dive::estimation
