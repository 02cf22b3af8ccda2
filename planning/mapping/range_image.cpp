#include "planning/mapping/range_image.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace dive::planning {
namespace {

constexpr float kNotLooked = -1.0F;
constexpr float kMinBin_deg = 2.5F;  // degrees per bin: a range camera's pixels are up to 2 apart
constexpr float kCoarsest = 10.0F;
constexpr double kDense = 7500.0;        // points of a scan that fill bins of kMinBin_deg
constexpr double kAround = 9.0;          // a bin and its neighbours
constexpr double kMaxGaps = 0.1;         // share of rays without a range in a scan without gaps
constexpr float kAlikeAbsolute = 0.15F;  // m
constexpr float kAlikeShare = 0.05F;     // share of the distance

// A particle close to the sensor fills as many pixels as a real obstacle; its size distinguishes
// it.
constexpr float kMaxParticleRange = 1.2F;  // m
constexpr float kMaxParticleSize = 0.06F;  // m, diagonal of its box

constexpr float kBeside = 5.0F;  // degrees between the points that define the surface normal
constexpr float kSliver = 0.1F;  // sine between them: three points on a line define no normal

constexpr float kPi = std::numbers::pi_v<float>;

}  // namespace

RangeImage::RangeImage(const RangeScan& scan, const Pose& X_WB)
    : origin_B_(scan.origin_B), reach_(scan.reach), utime_(scan.utime) {
  move(X_WB);
  const auto n = static_cast<double>(std::max<std::size_t>(scan.points_B.size(), 1));
  const float width =
      std::clamp(kMinBin_deg * static_cast<float>(std::sqrt(kDense / n)), kMinBin_deg, kCoarsest);
  columns_ = static_cast<int>(std::ceil(360.0F / width));
  rows_ = static_cast<int>(std::ceil(180.0F / width));
  ranges_by_bin_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_),
                        kNotLooked);
  point_of_.assign(ranges_by_bin_.size(), -1);
  ranges_.resize(scan.points_B.size());
  std::vector<int> bins(scan.points_B.size(), -1);
  std::size_t silent = 0;
  for (std::size_t i = 0; i < scan.points_B.size(); ++i) {
    const Eigen::Vector3f ray = scan.points_B[i] - origin_B_;
    ranges_[i] = ray.norm();
    if (!std::isfinite(ranges_[i]) || ranges_[i] <= 0.0F) {
      ranges_[i] = std::numeric_limits<float>::quiet_NaN();
      ++silent;
      continue;
    }
    bins[i] = bin(ray);
    const float range = ranges_[i] > reach_ ? std::numeric_limits<float>::infinity() : ranges_[i];
    float& nearest = ranges_by_bin_[static_cast<std::size_t>(bins[i])];
    if (nearest >= 0.0F && nearest <= range) continue;
    nearest = range;
    point_of_[static_cast<std::size_t>(bins[i])] = static_cast<int>(i);
  }
  has_gaps_ = static_cast<double>(silent) > kMaxGaps * n;
  count_neighbours(bins);
  leave_out_particles(scan, bins);
  spread();
}

void RangeImage::move(const Pose& X_WB) {
  X_WB_ = X_WB;
  R_BW_ = X_WB.q.conjugate().toRotationMatrix().cast<float>();
  origin_W_ = (X_WB * origin_B_.cast<double>()).cast<float>();
}

void RangeImage::forget_points() {
  ranges_ = {};
  neighbours_ = {};
  point_of_ = {};
}

// Uses the points 5 degrees to the left and right, above and below; at an edge one of the two.
std::optional<Eigen::Vector3f> RangeImage::normal_B(const RangeScan& scan, std::size_t i) const {
  const Eigen::Vector3f& here = scan.points_B[i];
  const int b = bin(here - origin_B_);
  const int apart =
      std::max(1, static_cast<int>(std::lround(kBeside / 360.0F * static_cast<float>(columns_))));
  const float alike = kAlikeAbsolute + kAlikeShare * ranges_[i];
  const auto beside = [&](int rows, int columns) -> const Eigen::Vector3f* {
    const int row = b / columns_ + rows;
    if (row < 0 || row >= rows_) return nullptr;
    const int column = (b % columns_ + columns + columns_) % columns_;
    const int point = point_of_[static_cast<std::size_t>(row * columns_ + column)];
    if (point < 0) return nullptr;
    const float range = ranges_[static_cast<std::size_t>(point)];
    return std::abs(range - ranges_[i]) <= alike ? &scan.points_B[static_cast<std::size_t>(point)]
                                                 : nullptr;
  };
  const auto along = [&](const Eigen::Vector3f* before, const Eigen::Vector3f* after) {
    return Eigen::Vector3f((after != nullptr ? *after : here) -
                           (before != nullptr ? *before : here));
  };
  const Eigen::Vector3f across = along(beside(0, -apart), beside(0, apart));
  const Eigen::Vector3f upwards = along(beside(-apart, 0), beside(apart, 0));
  const Eigen::Vector3f normal = across.cross(upwards);
  const float area = normal.norm();
  if (!(area > kSliver * across.norm() * upwards.norm())) return std::nullopt;
  return normal / area;
}

int RangeImage::bin(const Eigen::Vector3f& direction_B) const {
  const float azimuth = std::atan2(direction_B.y(), direction_B.x());
  const float elevation = std::atan2(direction_B.z(), std::hypot(direction_B.x(), direction_B.y()));
  const int column =
      std::clamp(static_cast<int>((azimuth + kPi) / (2.0F * kPi) * static_cast<float>(columns_)), 0,
                 columns_ - 1);
  const int row = std::clamp(
      static_cast<int>((elevation + kPi / 2.0F) / kPi * static_cast<float>(rows_)), 0, rows_ - 1);
  return row * columns_ + column;
}

template <typename Visit>
void RangeImage::around(std::size_t bin, Visit visit) const {
  const int row = static_cast<int>(bin) / columns_;
  const int column = static_cast<int>(bin) % columns_;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = column - 1; c <= column + 1; ++c) {
      visit(static_cast<std::size_t>(r * columns_ + (c + columns_) % columns_));
    }
  }
}

float RangeImage::alike_m(std::size_t i) const {
  return std::max(kAlikeAbsolute, kAlikeShare * ranges_[i]);
}

int RangeImage::scaled_up(int count, int in_view) const {
  if (has_gaps_ || count == 0) return count;
  return static_cast<int>(std::lround(kAround * count / in_view));
}

// A surface has neighbours in the range image at about its own distance, even at a grazing angle:
// along one of the directions the distance changes little. A drifting particle has none.
void RangeImage::count_neighbours(std::span<const int> bins) {
  std::vector<int> first(ranges_by_bin_.size() + 1, 0);
  for (const int b : bins) {
    if (b >= 0) ++first[static_cast<std::size_t>(b) + 1];
  }
  for (std::size_t b = 1; b < first.size(); ++b) first[b] += first[b - 1];
  std::vector<float> sorted(static_cast<std::size_t>(first.back()));
  std::vector<int> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i] >= 0) {
      sorted[static_cast<std::size_t>(next[static_cast<std::size_t>(bins[i])]++)] = ranges_[i];
    }
  }
  neighbours_.assign(bins.size(), 0);
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i] < 0 || ranges_[i] > reach_) continue;
    const float alike = alike_m(i);
    int count = -1;  // minus the point itself
    int in_view = 0;
    around(static_cast<std::size_t>(bins[i]), [&](std::size_t b) {
      in_view += is_observed(b) ? 1 : 0;
      for (int k = first[b]; k < first[b + 1]; ++k) {
        if (std::abs(sorted[static_cast<std::size_t>(k)] - ranges_[i]) <= alike) ++count;
      }
    });
    neighbours_[i] = scaled_up(count, in_view);
  }
}

int RangeImage::marked_neighbours(const RangeScan& scan, std::size_t i,
                                  const std::vector<bool>& marked) const {
  const int here = bin(scan.points_B[i] - origin_B_);
  const float alike = alike_m(i);
  int count = 0;
  int in_view = 0;
  around(static_cast<std::size_t>(here), [&](std::size_t b) {
    in_view += is_observed(b) ? 1 : 0;
    const int other = point_of_[b];
    if (other < 0 || static_cast<std::size_t>(other) == i) return;
    const auto point = static_cast<std::size_t>(other);
    if (marked[point] && std::abs(ranges_[point] - ranges_[i]) <= alike) ++count;
  });
  return scaled_up(count, in_view);
}

// Removes connected groups of bins that are small.
void RangeImage::leave_out_particles(const RangeScan& scan, std::span<const int> bins) {
  const auto may_be_particle = [&](std::size_t b) {
    return ranges_by_bin_[b] >= 0.0F && ranges_by_bin_[b] <= kMaxParticleRange;
  };
  const auto is_of = [&](std::size_t i, std::size_t b) {
    return std::abs(ranges_[i] - ranges_by_bin_[b]) <= kAlikeAbsolute;
  };
  std::vector<Eigen::AlignedBox3f> boxes(ranges_by_bin_.size());
  bool any = false;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i] < 0) continue;
    const auto b = static_cast<std::size_t>(bins[i]);
    any |= may_be_particle(b);
    if (is_of(i, b)) boxes[b].extend(scan.points_B[i]);
  }
  if (!any) return;

  std::vector<char> is_known(ranges_by_bin_.size(), 0);
  std::vector<char> is_particle(ranges_by_bin_.size(), 0);
  std::vector<std::size_t> patch;
  for (std::size_t start = 0; start < ranges_by_bin_.size(); ++start) {
    if (!may_be_particle(start) || is_known[start] != 0) continue;
    Eigen::AlignedBox3f box;
    patch.assign(1, start);
    is_known[start] = 1;
    for (std::size_t k = 0; k < patch.size(); ++k) {
      const std::size_t b = patch[k];
      box.extend(boxes[b]);
      around(b, [&](std::size_t other) {
        if (is_known[other] != 0 || ranges_by_bin_[other] < 0.0F) return;
        if (std::abs(ranges_by_bin_[other] - ranges_by_bin_[b]) > kAlikeAbsolute) return;
        is_known[other] = 1;
        patch.push_back(other);
      });
    }
    if (box.diagonal().norm() >= kMaxParticleSize) continue;
    for (const std::size_t b : patch) is_particle[b] = 1;
  }
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i] < 0) continue;
    const auto b = static_cast<std::size_t>(bins[i]);
    if (is_particle[b] != 0 && is_of(i, b)) neighbours_[i] = 0;
  }
}

// Sets every observed bin to the nearest range among its neighbours; others are unchanged.
void RangeImage::spread() {
  nearest_.assign(ranges_by_bin_.size(), kNotLooked);
  for (std::size_t at = 0; at < ranges_by_bin_.size(); ++at) {
    if (ranges_by_bin_[at] < 0.0F) continue;
    float least = ranges_by_bin_[at];
    around(at, [&](std::size_t b) {
      if (ranges_by_bin_[b] >= 0.0F) least = std::min(least, ranges_by_bin_[b]);
    });
    nearest_[at] = least;
  }
}

bool RangeImage::is_passed(const Eigen::Vector3f& p_W, float margin) const {
  const Eigen::Vector3f ray_W = p_W - origin_W_;
  const float distance = ray_W.norm();
  if (nearest_.empty() || !(distance > 0.0F && distance <= reach_)) return false;
  return nearest_[static_cast<std::size_t>(bin(R_BW_ * ray_W))] > distance + margin;
}

bool RangeImage::is_in_view(const Eigen::Vector3f& p_W) const {
  const Eigen::Vector3f ray_W = p_W - origin_W_;
  const float distance = ray_W.norm();
  if (ranges_by_bin_.empty() || !(distance > 0.0F && distance <= reach_)) return false;
  return ranges_by_bin_[static_cast<std::size_t>(bin(R_BW_ * ray_W))] > distance;
}

}  // namespace dive::planning
