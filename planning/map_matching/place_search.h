#pragma once
// Where does a scan fit, near a prior pose that may be wrong? Among equal objects at equal
// distances it fits in several places, and no covariance says so. Places that one scan cannot tell
// apart are followed from scan to scan, each with the evidence of what was seen from there: rows of
// pipes end somewhere (multiple hypotheses, Jensfelt and Kristensen 2001, without their probability
// of a position outside of all).
//
// Of place i, with cost c_i of the present scan (-2 log likelihood) and squared Mahalanobis
// distance m_i from the prior,
//
//   score_i = e_i - (c_i - min c) / 2 - share m_i / 2
//   e_i becomes exp(-s / L) (e_i - min(1, s / v) (c_i - min c) / 2)
//
// over s metres of way, since two scans from one pose say the same: v is the way after which a view
// is another one, L the memory.

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/map_matching/pose_prior.h"
#include "planning/map_matching/scan_fit.h"

namespace dive::planning {

class PlaceSearch {
 public:
  struct Result {
    FitMinimum best;
    /// One place, the same from scan to scan while the scans fit there: its motion is the vehicle's
    /// even if it is the wrong place.
    FitMinimum followed;
    bool is_continued = false;  ///< The followed place is that of the scan before.
    double ambiguity = 0.0;     ///< Likelihood of another place relative to the best.
  };

  /// Scans come in the order of their times. `covariance` of the shift of the prior's pose.
  [[nodiscard]] Result search(const ScanFit& fit, const PosePrior& prior,
                              const Matrix6d& covariance);

 private:
  struct Hypothesis {
    Eigen::Vector2d position_W;
    double evidence = 0.0;  // log-likelihood by earlier scans, relative to the best
    int id = 0;
  };
  struct Candidate {
    FitMinimum minimum;
    double from_prior = 0.0;  // squared Mahalanobis distance
    double evidence = 0.0;
    int id = 0;
    double worse = 0.0;  // log-likelihood of this scan below that of the best fit
    double score = 0.0;
  };

  double advance(const PosePrior& prior);
  [[nodiscard]] std::vector<Eigen::Vector2d> grid_minima(const ScanFit& fit,
                                                         const Matrix6d& covariance);
  [[nodiscard]] std::vector<Candidate> candidates(const ScanFit& fit, const PosePrior& prior,
                                                  const Matrix6d& covariance, bool is_wide);
  void score(std::vector<Candidate>& candidates, bool is_tracked) const;
  void remember(const std::vector<Candidate>& candidates, const PosePrior& prior, double way);
  void follow(const std::vector<Candidate>& candidates, Result& result);

  std::vector<Hypothesis> hypotheses_;
  Eigen::Vector2d odometry_O_ = Eigen::Vector2d::Zero();      // at the last scan, m
  Eigen::Quaterniond q_WB_ = Eigen::Quaterniond::Identity();  // at the last scan
  int scans_ = 0;                                             // in a row that searched
  int next_id_ = 0;
  int followed_ = -1;  // id
};

}  // namespace dive::planning
