#include "planning/trajopt/banded_qp.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"

namespace dive::planning {
namespace {

constexpr double kStart = 0.1;         // initial products, in units of scale_
constexpr double kToBoundary = 0.995;  // share of the distance to the nearest boundary in one step
constexpr double kCentring = 0.7;  // target as a share of the mean product, without a correction
constexpr double kMinStep = 0.01;  // step accepted whatever it does to the products

/// Longest step in [0, longest] that keeps value + step * change >= 0.
double limit_step(double longest, double value, double change) {
  return value + longest * change < 0.0 ? -value / change : longest;
}

double limit_step(double longest, const Vector6d& value, const Vector6d& change) {
  if (((value + longest * change).array() >= 0.0).all()) return longest;
  for (int i = 0; i < 6; ++i) longest = limit_step(longest, value(i), change(i));
  return longest;
}

/// The s > 0 with s lambda = mu and (s + gap)(w - lambda) = mu for some 0 < lambda < w: the point
/// of the central path for a hinge whose row misses its bound by `gap`.
double central_slack(double gap, double weight, double mu) {
  const double half = 0.5 * gap - mu / weight;
  const double root = std::sqrt(0.25 * gap * gap + mu * mu / (weight * weight));
  // Root of s^2 + 2 half s - gap mu / weight; the other form avoids cancellation when half > 0.
  return half <= 0.0 ? root - half : mu / weight * (gap / (root + half));
}

}  // namespace

BandedQp::BandedQp(int max_blocks, int max_rows)
    : blocks_(static_cast<std::size_t>(max_blocks)),
      max_rows_(static_cast<std::size_t>(max_rows)),
      hessian_(max_blocks),
      newton_(max_blocks),
      rhs_(static_cast<std::size_t>(max_blocks)) {
  rows_.reserve(max_rows_);
}

void BandedQp::reset(int blocks) {
  hessian_.set_zero(blocks);  // asserts the number of blocks
  newton_.set_zero(blocks);
  block_count_ = blocks;
  rows_.clear();
  for (int i = 0; i < blocks; ++i) {
    at(i).gradient.setZero();
    at(i).lower.setZero();
    at(i).upper.setZero();
  }
}

int BandedQp::add_row(const QpRow& row) {
  DIVE_DEMAND(rows_.size() < max_rows_);
  DIVE_DEMAND(row.block >= 0 && row.block < block_count_ && row.weight > 0.0);
  Row entry{};
  entry.given = row;
  entry.soft = std::isfinite(row.weight);
  if (row.block + 1 == block_count_) entry.given.a.tail<6>().setZero();
  rows_.push_back(entry);
  return static_cast<int>(rows_.size()) - 1;
}

double BandedQp::times_row(const Row& row, Vector6d Block::*vector) const {
  const int i = row.given.block;
  double product = row.given.a.head<6>().dot(at(i).*vector);
  if (i + 1 < block_count_) product += row.given.a.tail<6>().dot(at(i + 1).*vector);
  return product;
}

// The start satisfies all conditions of the central path except stationarity: every product is
// kStart * scale_. The scale is the largest change of the objective by one variable within its
// bounds, or by one hinge, so that the units of x and of the weights have no influence.
void BandedQp::initialise() {
  for (int i = 0; i < block_count_; ++i) at(i).x = 0.5 * (at(i).lower + at(i).upper);
  scale_ = 1e-12;
  for (int i = 0; i < block_count_; ++i) {
    const Vector6d slope =
        at(i).gradient + hessian_.multiply_row(i, [this](int j) { return at(j).x; });
    const Vector6d reach = 0.5 * (at(i).upper - at(i).lower);
    scale_ = std::max(scale_, slope.cwiseAbs().cwiseProduct(reach).maxCoeff());
  }
  for (const Row& row : rows_) {
    if (row.soft) scale_ = std::max(scale_, row.given.weight * row_reach(row));
  }
  products_ = 0.0;
  initialise_blocks();
  for (Row& row : rows_) initialise_row(row);
}

double BandedQp::row_reach(const Row& row) const {
  const int i = row.given.block;
  double reach = 0.5 * row.given.a.head<6>().cwiseAbs().dot(at(i).upper - at(i).lower);
  if (i + 1 < block_count_) {
    reach += 0.5 * row.given.a.tail<6>().cwiseAbs().dot(at(i + 1).upper - at(i + 1).lower);
  }
  return reach;
}

void BandedQp::initialise_blocks() {
  for (int i = 0; i < block_count_; ++i) {
    Block& block = at(i);
    const Vector6d reach = 0.5 * (block.upper - block.lower);
    block.dx.setZero();
    block.ddual_lower.setZero();
    block.ddual_upper.setZero();
    for (int k = 0; k < 6; ++k) {
      const bool is_free = reach(k) > 0.0;
      block.mask(k) = is_free ? 1.0 : 0.0;
      block.slack_lower(k) = block.slack_upper(k) = is_free ? reach(k) : 1.0;
      block.dual_lower(k) = block.dual_upper(k) = is_free ? kStart * scale_ / reach(k) : 0.0;
      products_ += 2.0 * block.mask(k);
    }
  }
}

void BandedQp::initialise_row(Row& row) {
  const double gap = row.given.b - times_row(row, &Block::x);
  const double reach = row_reach(row);
  row.s = row.t = row.lambda = 0.0;
  row.ds = row.dt = row.dlambda = 0.0;
  // Satisfied or violated everywhere within the bounds of x: a constant slope, nothing to decide.
  row.decided = std::isfinite(gap) && (gap <= -reach || (row.soft && gap >= reach));
  if (row.decided) {
    row.lambda = gap <= -reach ? 0.0 : row.given.weight;
    return;
  }
  products_ += row.soft ? 2.0 : 1.0;
  if (row.soft) {
    row.s = central_slack(gap, row.given.weight, kStart * scale_);
    row.t = std::max(row.s + gap, 0x1p-60 * row.s);
    row.lambda = std::min(kStart * scale_ / row.s, (1.0 - 0x1p-50) * row.given.weight);
  } else {
    row.s = std::max(std::abs(gap), 0x1p-20);
    row.lambda = kStart * scale_ / row.s;
  }
}

void BandedQp::update_residuals() {
  for (int i = 0; i < block_count_; ++i) {
    Block& block = at(i);
    block.residual = block.gradient + hessian_.multiply_row(i, [this](int j) { return at(j).x; }) -
                     block.dual_lower + block.dual_upper;
  }
  for (Row& row : rows_) {
    const int i = row.given.block;
    at(i).residual -= row.lambda * row.given.a.head<6>();
    if (i + 1 < block_count_) at(i + 1).residual -= row.lambda * row.given.a.tail<6>();
    row.infeasibility = row.decided ? 0.0 : times_row(row, &Block::x) + row.t - row.s - row.given.b;
  }
}

double BandedQp::complementarity() const { return complementarity_after(0.0); }

double BandedQp::complementarity_after(double step) const {
  double sum = 0.0;
  for (int i = 0; i < block_count_; ++i) {
    const Block& block = at(i);
    sum += (block.slack_lower + step * block.dx).dot(block.dual_lower + step * block.ddual_lower);
    sum += (block.slack_upper - step * block.dx).dot(block.dual_upper + step * block.ddual_upper);
  }
  for (const Row& row : rows_) {
    if (row.decided) continue;
    const double lambda = row.lambda + step * row.dlambda;
    sum += (row.s + step * row.ds) * lambda;
    if (row.soft) sum += (row.t + step * row.dt) * (row.given.weight - lambda);
  }
  return sum;
}

bool BandedQp::converged(double tolerance) const {
  const double limit = tolerance * scale_;
  for (int i = 0; i < block_count_; ++i) {
    const Vector6d reach = 0.5 * (at(i).upper - at(i).lower);  // zero if fixed
    if (!((at(i).residual.array() * reach.array()).abs() <= limit).all()) return false;
  }
  for (const Row& row : rows_) {
    if (!(std::abs(row.infeasibility) * row.lambda <= limit)) return false;
  }
  return complementarity() <= limit * products_;
}

bool BandedQp::factorise() {
  for (int i = 0; i < block_count_; ++i) {
    const Block& block = at(i);
    newton_.diagonal(i) = hessian_.diagonal(i);
    newton_.lower(i) = hessian_.lower(i);
    // A fixed variable has infinite stiffness; 1e100 has the same effect without another matrix.
    newton_.diagonal(i).diagonal() += block.dual_lower.cwiseQuotient(block.slack_lower) +
                                      block.dual_upper.cwiseQuotient(block.slack_upper) +
                                      1e100 * (Vector6d::Ones() - block.mask);
  }
  for (Row& row : rows_) {
    if (row.decided) continue;
    const double softness =
        row.s / row.lambda + (row.soft ? row.t / (row.given.weight - row.lambda) : 0.0);
    row.curvature = 1.0 / softness;
    const int i = row.given.block;
    const Vector6d head = row.given.a.head<6>();
    const Vector6d tail = row.given.a.tail<6>();
    const Vector6d scaled_head = row.curvature * head;
    newton_.diagonal(i).noalias() += head * scaled_head.transpose();
    if (i + 1 == block_count_) continue;
    newton_.lower(i).noalias() += tail * scaled_head.transpose();
    newton_.diagonal(i + 1).noalias() += tail * (row.curvature * tail).transpose();
  }
  return newton_.factorise();
}

void BandedQp::find_direction(const Direction& direction) {
  const double order = direction.second_order ? 1.0 : 0.0;
  for (int i = 0; i < block_count_; ++i) {
    Block& block = at(i);
    const Vector6d cross_lower = order * block.dx.cwiseProduct(block.ddual_lower);
    const Vector6d cross_upper = order * block.dx.cwiseProduct(block.ddual_upper);
    // From here on ddual is the part of the multiplier's change that does not depend on dx.
    block.ddual_lower =
        (direction.centring * block.mask - cross_lower).cwiseQuotient(block.slack_lower) -
        block.dual_lower;
    block.ddual_upper =
        (direction.centring * block.mask + cross_upper).cwiseQuotient(block.slack_upper) -
        block.dual_upper;
    rhs_[static_cast<std::size_t>(i)] = block.ddual_lower - block.ddual_upper - block.residual;
  }
  for (Row& row : rows_) {
    if (row.decided) continue;
    const double cross_s = order * row.ds * row.dlambda;
    const double cross_t = order * row.dt * row.dlambda;
    row.ds = (direction.centring - cross_s) / row.lambda - row.s;
    row.dt =
        row.soft ? (direction.centring + cross_t) / (row.given.weight - row.lambda) - row.t : 0.0;
    row.dlambda = row.curvature * (row.ds - row.dt - row.infeasibility);
    const int i = row.given.block;
    rhs_[static_cast<std::size_t>(i)] += row.dlambda * row.given.a.head<6>();
    if (i + 1 < block_count_) {
      rhs_[static_cast<std::size_t>(i) + 1] += row.dlambda * row.given.a.tail<6>();
    }
  }
  for (int i = 0; i < block_count_; ++i) {
    rhs_[static_cast<std::size_t>(i)] = rhs_[static_cast<std::size_t>(i)].cwiseProduct(at(i).mask);
  }
  newton_.solve({rhs_.data(), static_cast<std::size_t>(block_count_)});
  direction_of_blocks();
  direction_of_rows();
}

void BandedQp::direction_of_blocks() {
  for (int i = 0; i < block_count_; ++i) {
    Block& block = at(i);
    block.dx = rhs_[static_cast<std::size_t>(i)].cwiseProduct(block.mask);
    block.ddual_lower -= block.dual_lower.cwiseProduct(block.dx).cwiseQuotient(block.slack_lower);
    block.ddual_upper += block.dual_upper.cwiseProduct(block.dx).cwiseQuotient(block.slack_upper);
  }
}

void BandedQp::direction_of_rows() {
  for (Row& row : rows_) {
    if (row.decided) continue;
    row.dlambda -= row.curvature * times_row(row, &Block::dx);
    row.ds -= row.s / row.lambda * row.dlambda;
    if (row.soft) row.dt += row.t / (row.given.weight - row.lambda) * row.dlambda;
  }
}

double BandedQp::longest_step() const {
  double step = 1.0 / kToBoundary;
  for (int i = 0; i < block_count_; ++i) {
    const Block& block = at(i);
    step = limit_step(step, block.slack_lower, block.dx);
    step = limit_step(step, block.slack_upper, -block.dx);
    step = limit_step(step, block.dual_lower, block.ddual_lower);
    step = limit_step(step, block.dual_upper, block.ddual_upper);
  }
  for (const Row& row : rows_) {
    if (row.decided) continue;
    step = limit_step(step, row.s, row.ds);
    step = limit_step(step, row.lambda, row.dlambda);
    if (!row.soft) continue;
    step = limit_step(step, row.t, row.dt);
    step = limit_step(step, row.given.weight - row.lambda, -row.dlambda);
  }
  return step;
}

void BandedQp::move(double step) {
  for (int i = 0; i < block_count_; ++i) {
    Block& block = at(i);
    block.x += step * block.dx;
    block.slack_lower += step * block.dx;
    block.slack_upper -= step * block.dx;
    block.dual_lower += step * block.ddual_lower;
    block.dual_upper += step * block.ddual_upper;
    // A fixed variable's slack and multiplier stay 1 and 0: its dx is exactly zero.
  }
  for (Row& row : rows_) {
    row.s += step * row.ds;
    row.t += step * row.dt;
    row.lambda += step * row.dlambda;
  }
}

bool BandedQp::iterate() {
  if (!factorise()) return false;
  find_direction({.centring = 0.0, .second_order = false});
  const double now = complementarity();
  const double after = complementarity_after(std::min(1.0, longest_step()));
  const double ratio = std::max(0.0, after / now);
  find_direction({.centring = ratio * ratio * ratio * now / products_, .second_order = true});
  double step = std::min(1.0, kToBoundary * longest_step());
  if (complementarity_after(step) > now) {
    // The correction assumes a full step; with very unequal products it can lead away from the
    // central path, and the iteration cycles.
    find_direction({.centring = kCentring * now / products_, .second_order = false});
    step = std::min(1.0, kToBoundary * longest_step());
    while (complementarity_after(step) > now && step > kMinStep) step *= 0.5;
  }
  move(step);
  return true;
}

QpSummary BandedQp::summarise(QpStatus status, int iterations) {
  QpSummary summary{.status = status, .iterations = iterations};
  summary.complementarity = complementarity();
  for (int i = 0; i < block_count_; ++i) {
    Block& block = at(i);
    const Vector6d Hx = hessian_.multiply_row(i, [this](int j) { return at(j).x; });
    summary.objective += block.x.dot(0.5 * Hx + block.gradient);
    // The multiplier of a fixed variable is the one that balances the rest.
    const Vector6d held = (Vector6d::Ones() - block.mask).cwiseProduct(block.residual);
    block.dual_lower += held.cwiseMax(0.0);
    block.dual_upper -= held.cwiseMin(0.0);
    block.residual -= held;
    summary.stationarity = std::max(summary.stationarity, block.residual.cwiseAbs().maxCoeff());
  }
  for (const Row& row : rows_) {
    const double gap = std::max(0.0, row.given.b - times_row(row, &Block::x));
    if (row.soft) summary.objective += row.given.weight * gap;
    if (!row.soft) summary.infeasibility = std::max(summary.infeasibility, gap);
  }
  return summary;
}

QpSummary BandedQp::solve(const QpOptions& options) {
  DIVE_DEMAND(block_count_ > 0);
  for (int i = 0; i < block_count_; ++i) {
    DIVE_DEMAND((at(i).lower.array() <= at(i).upper.array()).all());
  }
  initialise();
  update_residuals();
  for (int iteration = 0;; ++iteration) {
    if (converged(options.tolerance)) return summarise(QpStatus::kSolved, iteration);
    if (iteration == options.max_iterations) return summarise(QpStatus::kIterationLimit, iteration);
    if (!iterate()) return summarise(QpStatus::kNumericalError, iteration);
    update_residuals();
  }
}

}  // namespace dive::planning
