#include "planning/map_matching/place_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace dive::planning {
namespace {

using Eigen::Vector2d;

constexpr double kWorthSearch = 0.08;    // m, one sigma: below, no other minimum is within reach
constexpr double kSearch = 3.0;          // sigmas around the prior
constexpr double kMinSearch = 0.7;       // m around the prior
constexpr double kMaxSearch = 3.0;       // m around the prior
constexpr double kGridStep = 0.25;       // m between places that are tried
constexpr std::size_t kMaxPlaces = 200;  // that are tried: the step grows beyond
constexpr std::size_t kFromGrid = 6;     // places from which a minimum is sought
constexpr std::size_t kFollowed = 8;     // places that are followed
constexpr double kPlaceSigma = 0.12;     // m: of a place from scan to scan
constexpr double kSlides = 3.0;          // sigmas of a place: beyond, it is another one
constexpr double kSamePlace = 0.12;      // m between two minima that are one
constexpr double kReached = 0.05;        // m from a minimum, where a descent would end there
constexpr double kDoubt = 0.25;          // share of a prior that may be half as good as it says
constexpr double kView = 1.0;            // m: v
constexpr double kMemory = 15.0;         // m: L
constexpr double kTurnAsWay = 1.0;       // m per rad: a turn shows another view too
constexpr double kNewcomer = -3.0;       // log-likelihood at best of a place not found before
constexpr double kHopeless = -8.0;       // log-likelihood below which a place is dropped
constexpr double kBetter = 3.0;          // log-likelihood by which another place is followed

Vector6d at(const Vector2d& shift) {
  Vector6d result = Vector6d::Zero();
  result.head<2>() = shift;
  return result;
}

// Of the horizontal position, with height, heading and tilt as uncertain as the prior says.
Eigen::Matrix2d horizontal_information(const FitMinimum& minimum, const Matrix6d& covariance) {
  const Matrix6d information = minimum.at.information / minimum.at.excess();
  const Eigen::Matrix<double, 2, 4> cross = information.topRightCorner<2, 4>();
  const Eigen::Matrix4d others =
      information.bottomRightCorner<4, 4>() + covariance.bottomRightCorner<4, 4>().inverse();
  return information.topLeftCorner<2, 2>() - cross * others.inverse() * cross.transpose();
}

// Where a minimum is sought from, and the prior with which it is.
struct Descent {
  Vector6d from;
  Vector6d mean;
  Matrix6d covariance;
};

// Around the place itself, because a prior around the believed position draws the minimum over to
// the next place; only where the scene leaves a direction free, as along a wall, the prior says
// where along it.
Descent descent_at(const ScanFit& fit, const Vector2d& place, const Matrix6d& covariance) {
  Matrix6d near = covariance;
  near.topRows<2>().setZero();
  near.leftCols<2>().setZero();
  near.topLeftCorner<2, 2>().diagonal().setConstant(kPlaceSigma * kPlaceSigma);
  const FitMinimum here = fit.approach(at(place), at(place), near);
  const auto stay = [&] { return Descent{here.shift, at(place), near}; };
  if (!here.is_usable()) return stay();
  const Eigen::Matrix2d horizontal = horizontal_information(here, covariance);
  const double weakest =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(horizontal).eigenvalues().x();
  if (weakest > 1.0 / (kPlaceSigma * kPlaceSigma)) return stay();
  const FitMinimum drawn = fit.approach(here.shift, Vector6d::Zero(), covariance);
  const Vector2d by = (drawn.shift - here.shift).head<2>();
  if (by.dot(horizontal * by) >= kSlides * kSlides) return stay();
  return {drawn.shift, Vector6d::Zero(), covariance};
}

}  // namespace

// The hypotheses move with the vehicle. Returns the way since the last scan, m.
double PlaceSearch::advance(const PosePrior& prior) {
  const Vector2d moved_O = prior.odometry_O - odometry_O_;
  const Vector2d moved_W = Eigen::Rotation2Dd(prior.heading_correction) * moved_O;
  const double way = moved_O.norm() + kTurnAsWay * q_WB_.angularDistance(prior.X_WB.q);
  odometry_O_ = prior.odometry_O;
  q_WB_ = prior.X_WB.q;
  for (Hypothesis& one : hypotheses_) one.position_W += moved_W;
  return way;
}

// The places of a grid around the prior where the scan fits best, no two within a step. Successive
// scans try grids that are shifted by half a step, so that none falls between the places of all.
std::vector<Vector2d> PlaceSearch::grid_minima(const ScanFit& fit, const Matrix6d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance.topLeftCorner<2, 2>());
  const Vector2d reach = (kSearch * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt())
                             .cwiseMax(kMinSearch)
                             .cwiseMin(kMaxSearch);
  const double area = std::numbers::pi * reach.x() * reach.y();
  const double step = std::max(kGridStep, std::sqrt(area / static_cast<double>(kMaxPlaces)));
  const Vector2d phase(scans_ % 2 == 0 ? 0.0 : 0.5, scans_ / 2 % 2 == 0 ? 0.0 : 0.5);
  struct Place {
    Vector2d shift;
    double misfit;
  };
  std::vector<Place> places;
  const int columns = static_cast<int>(reach.x() / step);
  const int rows = static_cast<int>(reach.y() / step);
  for (int i = -columns; i <= columns; ++i) {
    for (int k = -rows; k <= rows; ++k) {
      const Vector2d along = step * (Vector2d(i, k) + phase);
      if (along.cwiseQuotient(reach).norm() > 1.0) continue;
      const Vector2d shift = axes.eigenvectors() * along;
      places.push_back({shift, fit.misfit(shift)});
    }
  }
  std::ranges::sort(places, {}, &Place::misfit);
  std::vector<Vector2d> best;
  for (const Place& place : places) {
    if (best.size() == kFromGrid) break;
    const bool is_new = std::ranges::all_of(
        best, [&](const Vector2d& other) { return (place.shift - other).norm() > 1.01 * step; });
    if (is_new) best.push_back(place.shift);
  }
  return best;
}

// Minima from the followed places, and from new ones: first of all from the prior itself.
std::vector<PlaceSearch::Candidate> PlaceSearch::candidates(const ScanFit& fit,
                                                            const PosePrior& prior,
                                                            const Matrix6d& covariance,
                                                            bool is_wide) {
  const Matrix6d information = covariance.inverse();
  std::vector<Candidate> found;
  const auto add = [&](const Vector2d& from, double evidence, int id) {
    const Descent descent = descent_at(fit, from, covariance);
    const auto reached = std::ranges::find_if(found, [&](const Candidate& other) {
      return (other.minimum.shift - descent.from).head<2>().norm() < kReached;
    });
    if (reached != found.end()) {
      reached->evidence = std::max(reached->evidence, evidence);
      return;
    }
    const FitMinimum minimum = fit.descend(descent.from, descent.mean, descent.covariance);
    const double from_prior = minimum.shift.dot(information * minimum.shift);
    const auto same = std::ranges::find_if(found, [&](const Candidate& other) {
      return (other.minimum.shift - minimum.shift).head<2>().norm() < kSamePlace;
    });
    if (same == found.end()) {
      found.push_back({minimum, from_prior, evidence, id < 0 ? next_id_++ : id});
      return;
    }
    if (minimum.is_usable() && minimum.at.cost < same->minimum.at.cost) {
      same->minimum = minimum;
      same->from_prior = from_prior;
    }
    same->evidence = std::max(same->evidence, evidence);
  };
  const double newcomer = hypotheses_.empty() ? 0.0 : kNewcomer;
  for (const Hypothesis& one : hypotheses_) {
    add(one.position_W - prior.X_WB.p.head<2>(), one.evidence, one.id);
  }
  add(Vector2d::Zero(), newcomer, -1);
  if (is_wide) {
    for (const Vector2d& place : grid_minima(fit, covariance)) add(place, newcomer, -1);
  }
  return found;
}

// The best first; those with too few points on mapped surfaces are left out.
void PlaceSearch::score(std::vector<Candidate>& candidates, bool is_tracked) const {
  std::erase_if(candidates, [](const Candidate& one) { return !one.minimum.is_usable(); });
  if (candidates.empty()) return;
  const FitNormal& fitting = std::ranges::min_element(candidates, {}, [](const Candidate& one) {
                               return one.minimum.at.cost;
                             })->minimum.at;
  const double least = fitting.cost;
  const double excess = fitting.excess();
  const double share = is_tracked && hypotheses_.size() < 2 ? 1.0 : kDoubt;
  for (Candidate& one : candidates) {
    one.worse = 0.5 * (one.minimum.at.cost - least) / excess;
    one.score = one.evidence - one.worse - 0.5 * share * one.from_prior;
  }
  std::ranges::sort(candidates, std::greater{}, &Candidate::score);
}

void PlaceSearch::remember(const std::vector<Candidate>& candidates, const PosePrior& prior,
                           double way) {
  const double gain = std::min(1.0, way / kView);
  const double kept = std::exp(-way / kMemory);
  hypotheses_.clear();
  double most = -std::numeric_limits<double>::infinity();
  for (const Candidate& one : candidates) {
    if (hypotheses_.size() == kFollowed) break;
    const double evidence = kept * (one.evidence - gain * one.worse);
    most = std::max(most, evidence);
    hypotheses_.push_back({prior.X_WB.p.head<2>() + one.minimum.shift.head<2>(), evidence, one.id});
  }
  for (Hypothesis& one : hypotheses_) one.evidence -= most;
  std::erase_if(hypotheses_, [](const Hypothesis& one) { return one.evidence < kHopeless; });
}

void PlaceSearch::follow(const std::vector<Candidate>& candidates, Result& result) {
  const Candidate& best = candidates.front();
  const auto same = std::ranges::find(candidates, followed_, &Candidate::id);
  result.is_continued = same != candidates.end() && same->score > best.score - kBetter;
  const Candidate& followed = result.is_continued ? *same : best;
  result.followed = followed.minimum;
  followed_ = followed.id;
}

PlaceSearch::Result PlaceSearch::search(const ScanFit& fit, const PosePrior& prior,
                                        const Matrix6d& covariance) {
  const double way = advance(prior);
  const bool is_wide = widest_variance(covariance) >= kWorthSearch * kWorthSearch;
  Result result;
  if (!is_wide && hypotheses_.size() < 2) {
    hypotheses_.clear();
    scans_ = 0;
    result.best = fit.descend(Vector6d::Zero(), Vector6d::Zero(), covariance);
    return result;
  }
  ++scans_;
  std::vector<Candidate> found = candidates(fit, prior, covariance, is_wide);
  result.best = found.front().minimum;
  score(found, prior.is_tracked);
  if (found.empty()) return result;
  result.best = found.front().minimum;
  if (found.size() > 1) {
    result.ambiguity = std::min(1.0, std::exp(found[1].score - found[0].score));
  }
  follow(found, result);
  remember(found, prior, way);
  return result;
}

}  // namespace dive::planning
