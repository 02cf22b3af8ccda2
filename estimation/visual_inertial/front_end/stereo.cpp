#include "estimation/visual_inertial/front_end/stereo.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include "common/assert.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2f;
using Eigen::Vector3d;

constexpr int kPatch = 4;               // pixels of the half-size image to each side
constexpr int kMaxEpipolarSteps = 400;  // along an epipolar line
constexpr double kMinScore = 0.8;       // of the correlation
constexpr double kMinLead = 0.05;       // of the best position over all that are not beside it
constexpr int kSide = 2 * kPatch + 1;
constexpr int kCount = kSide * kSide;

struct Place {
  int x;
  int y;
};

Place in_half(const Vector2d& pixel) {
  return {static_cast<int>(std::lround(0.5 * (pixel.x() - 0.5))),
          static_cast<int>(std::lround(0.5 * (pixel.y() - 0.5)))};
}

bool has_patch(const GrayView& image, const Place& p) {
  return p.x >= kPatch && p.y >= kPatch && p.x < image.width - kPatch &&
         p.y < image.height - kPatch;
}

// Normalised cross-correlation of the patches around two positions, in [-1, 1].
double correlation(const GrayView& a, const Place& pa, const GrayView& b, const Place& pb) {
  int sum_a = 0;
  int sum_b = 0;
  int sum_aa = 0;
  int sum_bb = 0;
  int sum_ab = 0;
  for (int dy = -kPatch; dy <= kPatch; ++dy) {
    const std::uint8_t* row_a =
        a.pixels + static_cast<std::ptrdiff_t>(pa.y + dy) * a.width + pa.x - kPatch;
    const std::uint8_t* row_b =
        b.pixels + static_cast<std::ptrdiff_t>(pb.y + dy) * b.width + pb.x - kPatch;
    for (int k = 0; k < kSide; ++k) {
      const int va = row_a[k];
      const int vb = row_b[k];
      sum_a += va;
      sum_b += vb;
      sum_aa += va * va;
      sum_bb += vb * vb;
      sum_ab += va * vb;
    }
  }
  const auto moment = [](int xy, int x, int y) {
    return static_cast<double>(xy) - static_cast<double>(x) * y / kCount;
  };
  const double aa = moment(sum_aa, sum_a, sum_a);
  const double bb = moment(sum_bb, sum_b, sum_b);
  if (aa < 1.0 || bb < 1.0) return -1.0;
  return moment(sum_ab, sum_a, sum_b) / std::sqrt(aa * bb);
}

}  // namespace

std::string StereoOptions::validate() const {
  if (!(min_depth_m >= 0.01 && max_depth_m <= 1e4 && max_depth_m > 2.0 * min_depth_m)) {
    return fmt::format(
        "stereo depths from {} to {} m; they must lie between 0.01 and 10000, the "
        "larger more than twice the smaller",
        min_depth_m, max_depth_m);
  }
  if (!(back_px > 0.0 && back_px <= 10.0 && epipolar_px > 0.0 && epipolar_px <= 10.0)) {
    return fmt::format("stereo tolerances of {} and {} pixels; each must be above 0 and at most 10",
                       back_px, epipolar_px);
  }
  return {};
}

StereoMatcher::StereoMatcher(StereoOptions options, const CameraModel& left,
                             const CameraModel& right, int window_px)
    : options_(options), right_(right), klt_(window_px) {
  DIVE_DEMAND(options.validate().empty() && left.validate().empty() && right.validate().empty());
  DIVE_DEMAND(left.width == right.width && left.height == right.height);
  const Pose X_RL = right.X_BC.inverse() * left.X_BC;
  DIVE_DEMAND(X_RL.p.norm() > kMinBaseline_m);
  R_RL_ = X_RL.q.toRotationMatrix();
  p_RL_ = X_RL.p;
}

std::optional<Vector2d> StereoMatcher::right_pixel(const Vector2d& left,
                                                   double inverse_depth) const {
  auto pixel = right_.project(R_RL_ * left.homogeneous() + inverse_depth * p_RL_);
  if (!pixel || !right_.in_image(*pixel)) return std::nullopt;
  return pixel;
}

// Steps of about two pixels; uniform inverse depth is nearly uniform in the image.
std::optional<Vector2f> StereoMatcher::search(const ImagePair& left, const ImagePair& right,
                                              const StereoQuery& query) const {
  const Place here = in_half(query.pixel.cast<double>());
  if (!has_patch(left.half, here)) return std::nullopt;
  const double nearest = 1.0 / options_.min_depth_m;
  const double shift_px = right_.focal() * p_RL_.norm() * nearest;
  const int steps = std::clamp(static_cast<int>(0.5 * shift_px), 1, kMaxEpipolarSteps);
  double best = kMinScore;
  double second = 0.0;  // score of the best that is not beside it
  int best_step = -1;
  Vector2d at;
  std::vector<double> scores(static_cast<std::size_t>(steps) + 1, -1.0);
  for (int k = 0; k <= steps; ++k) {
    const auto pixel = right_pixel(query.left, nearest * k / steps);
    if (!pixel) continue;
    const Place there = in_half(*pixel);
    if (!has_patch(right.half, there)) continue;
    const double score = correlation(left.half, here, right.half, there);
    scores[static_cast<std::size_t>(k)] = score;
    if (score > best) {
      best = score;
      best_step = k;
      at = *pixel;
    }
  }
  if (best_step < 0) return std::nullopt;
  for (int k = 0; k <= steps; ++k) {
    if (std::abs(k - best_step) > kPatch) {
      second = std::max(second, scores[static_cast<std::size_t>(k)]);
    }
  }
  if (best < second + kMinLead) return std::nullopt;
  return at.cast<float>();
}

// With b = R [n, 1] and baseline p, the match f obeys f x (b + rho p) = 0: rho by least squares in
// pixels, and the residual is the distance from the epipolar line.
std::optional<StereoMatch> StereoMatcher::accepted(const StereoQuery& query,
                                                   const Vector2f& found) const {
  if (!right_.in_image(found.cast<double>(), 1.0)) return std::nullopt;
  const auto n = right_.undistort(found.cast<double>());
  if (!n) return std::nullopt;
  const Vector3d b = R_RL_ * query.left.homogeneous();
  // x_R = (b.xy + rho p.xy) / (b.z + rho p.z): two equations, linear in rho.
  const Vector2d by_rho = p_RL_.head<2>() - *n * p_RL_.z();
  if (by_rho.squaredNorm() < 1e-12) return std::nullopt;
  const Eigen::Matrix2d J = right_.jacobian(*n);
  const Vector2d a = J * by_rho;
  const Vector2d c = J * (*n * b.z() - b.head<2>());
  const double rho = a.dot(c) / a.squaredNorm();
  const double tolerance = options_.epipolar_px;
  const double depth_R = b.z() + rho * p_RL_.z();
  if (!(depth_R > 0.0)) return std::nullopt;
  if ((c - rho * a).norm() > tolerance * depth_R) return std::nullopt;
  // Noise moves far points beyond infinity, but not far beyond.
  if (rho * a.norm() < -tolerance || rho > 1.0 / options_.min_depth_m) return std::nullopt;
  return StereoMatch{*n, rho < 1.0 / options_.max_depth_m ? 0.0 : rho};
}

tl::expected<std::vector<std::optional<StereoMatch>>, std::string> StereoMatcher::match(
    const ImagePair& left, const ImagePair& right, const std::vector<StereoQuery>& queries) {
  std::vector<std::optional<StereoMatch>> matches(queries.size());
  std::vector<std::size_t> asked;
  std::vector<Vector2f> from;
  std::vector<Vector2f> guesses;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    std::optional<Vector2f> guess;
    if (queries[i].inverse_depth) {
      if (const auto p = right_pixel(queries[i].left, *queries[i].inverse_depth)) {
        guess = p->cast<float>();
      }
    } else {
      guess = search(left, right, queries[i]);
    }
    if (!guess) continue;
    asked.push_back(i);
    from.push_back(queries[i].pixel);
    guesses.push_back(*guess);
  }
  const auto found = klt_.follow(left.full, right.full, from, guesses, kLevels);
  if (!found) return tl::make_unexpected(found.error());

  std::vector<std::size_t> there;
  std::vector<Vector2f> back_from;
  std::vector<Vector2f> back_guesses;
  for (std::size_t k = 0; k < asked.size(); ++k) {
    if (!(*found)[k]) continue;
    matches[asked[k]] = accepted(queries[asked[k]], *(*found)[k]);
    if (!matches[asked[k]]) continue;
    there.push_back(k);
    back_from.push_back(*(*found)[k]);
    // Back by the guessed shift: a search from the position itself would succeed too easily.
    back_guesses.push_back(*(*found)[k] - (guesses[k] - from[k]));
  }
  const auto back = klt_.follow(right.full, left.full, back_from, back_guesses, 0);
  if (!back) return tl::make_unexpected(back.error());
  for (std::size_t k = 0; k < there.size(); ++k) {
    const auto& returned = (*back)[k];
    const Vector2f& start = from[there[k]];
    if (!returned || (*returned - start).norm() > static_cast<float>(options_.back_px)) {
      matches[asked[there[k]]].reset();
    }
  }
  return matches;
}

}  // namespace dive::estimation
