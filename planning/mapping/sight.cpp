#include "planning/mapping/sight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace dive::planning {
namespace {

constexpr float kNotLooked = -1.0F;
constexpr float kFinest = 2.5F;  // degrees per bin: a range camera's pixels are up to 2 apart
constexpr float kCoarsest = 10.0F;
constexpr double kDense = 7500.0;        // points of a scan that fill bins of kFinest
constexpr float kAlikeAbsolute = 0.15F;  // m
constexpr float kAlikeShare = 0.05F;     // share of the distance

// A particle close to the sensor fills as many pixels as a real obstacle; its size distinguishes
// it.
constexpr float kSpeckRange = 1.2F;  // m
constexpr float kSpeckSize = 0.06F;  // m, diagonal of its box

constexpr float kBeside = 5.0F;  // degrees between the points that define the surface normal
constexpr float kSliver = 0.1F;  // sine between them: three points on a line define no normal

constexpr float kPi = std::numbers::pi_v<float>;

}  // namespace

Sight::Sight(const RangeScan& scan, const Pose& X_WB)
    : origin_B_(scan.origin_B), reach_(scan.reach), utime_(scan.utime) {
  move(X_WB);
  const auto n = static_cast<double>(std::max<std::size_t>(scan.points_B.size(), 1));
  const float width =
      std::clamp(kFinest * static_cast<float>(std::sqrt(kDense / n)), kFinest, kCoarsest);
  columns_ = static_cast<int>(std::ceil(360.0F / width));
  rows_ = static_cast<int>(std::ceil(180.0F / width));
  told_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNotLooked);
  point_of_.assign(told_.size(), -1);
  ranges_.resize(scan.points_B.size());
  std::vector<int> bins(scan.points_B.size(), -1);
  for (std::size_t i = 0; i < scan.points_B.size(); ++i) {
    const Eigen::Vector3f ray = scan.points_B[i] - origin_B_;
    ranges_[i] = ray.norm();
    if (!std::isfinite(ranges_[i]) || ranges_[i] <= 0.0F) {
      ranges_[i] = std::numeric_limits<float>::quiet_NaN();
      continue;
    }
    bins[i] = bin(ray);
    const float told = ranges_[i] > reach_ ? std::numeric_limits<float>::infinity() : ranges_[i];
    float& nearest = told_[static_cast<std::size_t>(bins[i])];
    if (nearest >= 0.0F && nearest <= told) continue;
    nearest = told;
    point_of_[static_cast<std::size_t>(bins[i])] = static_cast<int>(i);
  }
  count_neighbours(bins);
  leave_out_specks(scan, bins);
  spread();
}

void Sight::move(const Pose& X_WB) {
  X_WB_ = X_WB;
  R_BW_ = X_WB.q.conjugate().toRotationMatrix().cast<float>();
  origin_W_ = (X_WB * origin_B_.cast<double>()).cast<float>();
}

void Sight::forget_points() {
  ranges_ = {};
  neighbours_ = {};
  point_of_ = {};
}

// Uses the points 5 degrees to the left and right, above and below; at an edge one of the two.
std::optional<Eigen::Vector3f> Sight::normal_B(const RangeScan& scan, std::size_t i) const {
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

int Sight::bin(const Eigen::Vector3f& direction_B) const {
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
void Sight::around(std::size_t bin, Visit visit) const {
  const int row = static_cast<int>(bin) / columns_;
  const int column = static_cast<int>(bin) % columns_;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = column - 1; c <= column + 1; ++c) {
      visit(static_cast<std::size_t>(r * columns_ + (c + columns_) % columns_));
    }
  }
}

// A surface has neighbours in the range image at about its own distance, even at a grazing angle:
// along one of the directions the distance changes little. A drifting particle has none.
void Sight::count_neighbours(std::span<const int> bins) {
  std::vector<int> first(told_.size() + 1, 0);
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
    const float alike = std::max(kAlikeAbsolute, kAlikeShare * ranges_[i]);
    int count = -1;  // minus the point itself
    around(static_cast<std::size_t>(bins[i]), [&](std::size_t b) {
      for (int k = first[b]; k < first[b + 1]; ++k) {
        if (std::abs(sorted[static_cast<std::size_t>(k)] - ranges_[i]) <= alike) ++count;
      }
    });
    neighbours_[i] = count;
  }
}

// Removes connected groups of bins that are small.
void Sight::leave_out_specks(const RangeScan& scan, std::span<const int> bins) {
  const auto may_be_speck = [&](std::size_t b) {
    return told_[b] >= 0.0F && told_[b] <= kSpeckRange;
  };
  const auto is_of = [&](std::size_t i, std::size_t b) {
    return std::abs(ranges_[i] - told_[b]) <= kAlikeAbsolute;
  };
  std::vector<Eigen::AlignedBox3f> boxes(told_.size());
  bool any = false;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i] < 0) continue;
    const auto b = static_cast<std::size_t>(bins[i]);
    any |= may_be_speck(b);
    if (is_of(i, b)) boxes[b].extend(scan.points_B[i]);
  }
  if (!any) return;

  std::vector<char> is_known(told_.size(), 0);
  std::vector<char> is_speck(told_.size(), 0);
  std::vector<std::size_t> patch;
  for (std::size_t start = 0; start < told_.size(); ++start) {
    if (!may_be_speck(start) || is_known[start] != 0) continue;
    Eigen::AlignedBox3f box;
    patch.assign(1, start);
    is_known[start] = 1;
    for (std::size_t k = 0; k < patch.size(); ++k) {
      const std::size_t b = patch[k];
      box.extend(boxes[b]);
      around(b, [&](std::size_t other) {
        if (is_known[other] != 0 || told_[other] < 0.0F) return;
        if (std::abs(told_[other] - told_[b]) > kAlikeAbsolute) return;
        is_known[other] = 1;
        patch.push_back(other);
      });
    }
    if (box.diagonal().norm() >= kSpeckSize) continue;
    for (const std::size_t b : patch) is_speck[b] = 1;
  }
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i] < 0) continue;
    const auto b = static_cast<std::size_t>(bins[i]);
    if (is_speck[b] != 0 && is_of(i, b)) neighbours_[i] = 0;
  }
}

// Sets every observed bin to the nearest range among its neighbours; others are unchanged.
void Sight::spread() {
  nearest_.assign(told_.size(), kNotLooked);
  for (std::size_t at = 0; at < told_.size(); ++at) {
    if (told_[at] < 0.0F) continue;
    float least = told_[at];
    around(at, [&](std::size_t b) {
      if (told_[b] >= 0.0F) least = std::min(least, told_[b]);
    });
    nearest_[at] = least;
  }
}

bool Sight::is_past(const Eigen::Vector3f& p_W, float margin) const {
  const Eigen::Vector3f ray_W = p_W - origin_W_;
  const float distance = ray_W.norm();
  if (nearest_.empty() || !(distance > 0.0F && distance <= reach_)) return false;
  return nearest_[static_cast<std::size_t>(bin(R_BW_ * ray_W))] > distance + margin;
}

bool Sight::has_seen(const Eigen::Vector3f& p_W) const {
  const Eigen::Vector3f ray_W = p_W - origin_W_;
  const float distance = ray_W.norm();
  if (told_.empty() || !(distance > 0.0F && distance <= reach_)) return false;
  return told_[static_cast<std::size_t>(bin(R_BW_ * ray_W))] > distance;
}

}  // namespace dive::planning
