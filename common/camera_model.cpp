#include "common/camera_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

namespace dive {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Radtan = std::array<double, 8>;

constexpr double kNear = 1e-6;    // minimum of z; nearer, the projection is singular
constexpr double kExact = 1e-12;  // tolerance of n
constexpr int kMaxIterations = 20;
constexpr int kMaxHalvings = 12;
constexpr int kBranchSamples = 16;     // on the way from the axis, to notice a fold
constexpr double kMaxRadius = 11.43;   // tan(85 degrees)
constexpr double kMaxAngle = 1.48353;  // rad, 85 degrees
constexpr double kMaxRadtan = 100.0;
constexpr double kMaxIndex = 1.6;
constexpr double kLongestReadout = 0.1;  // s
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Radius {
  double rho;
  double slope;  // d rho / d r
};

// --- a flat port: the tangent of the angle in the air as a function of r ---

// Infinite where no ray from the water leaves the glass at that angle.
Radius port_radius(double index, double r) {
  const double in_water = std::sqrt(1.0 + r * r);
  const double sine = index * r / in_water;
  if (!(sine < 1.0)) return {kInfinity, kInfinity};
  const double cosine = std::sqrt(1.0 - sine * sine);
  return {sine / cosine, index / std::pow(cosine * in_water, 3)};
}

double port_inverse(double index, double rho) {
  const double sine = rho / std::sqrt(1.0 + rho * rho) / index;
  return sine / std::sqrt(1.0 - sine * sine);
}

// d rho / d index.
double port_index_slope(double index, double r) {
  const double sine_in_water = r / std::sqrt(1.0 + r * r);
  return sine_in_water / std::pow(1.0 - std::pow(index * sine_in_water, 2), 1.5);
}

// --- the lens: rho = g r as a function of r ---

// theta_d and d theta_d / d theta.
Radius equidistant_angle(const std::array<double, 4>& k, double theta) {
  const double s = theta * theta;
  return {theta * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))),
          1.0 + s * (3.0 * k[0] + s * (5.0 * k[1] + s * (7.0 * k[2] + s * 9.0 * k[3])))};
}

Radius lens_radius(const CameraModel& camera, double r) {
  const auto& p = camera.lens_parameters;
  const double r2 = r * r;
  switch (camera.lens) {
    case LensModel::kPinhole:
      break;
    case LensModel::kEquidistant: {
      const Radius angle = equidistant_angle(p, std::atan(r));
      return {angle.rho, angle.slope / (1.0 + r2)};
    }
    case LensModel::kEucm: {
      const auto [alpha, beta] = std::pair(p[0], p[1]);
      const double d = std::sqrt(beta * r2 + 1.0);
      const double below = alpha * d + 1.0 - alpha;
      return {r / below, (below - alpha * beta * r2 / d) / (below * below)};
    }
    case LensModel::kDoubleSphere: {
      const auto [xi, alpha] = std::pair(p[0], p[1]);
      const double d1 = std::sqrt(r2 + 1.0);
      const double w = xi * d1 + 1.0;
      const double d2 = std::sqrt(r2 + w * w);
      const double below = alpha * d2 + (1.0 - alpha) * w;
      const double w_slope = xi * r / d1;
      const double below_slope = alpha * (r + w * w_slope) / d2 + (1.0 - alpha) * w_slope;
      return {r / below, (below - r * below_slope) / (below * below)};
    }
  }
  return {r, 1.0};
}

// theta of theta_d on the branch that begins at the axis.
std::optional<double> equidistant_inverse(const std::array<double, 4>& k, double rho) {
  double theta = 0.0;
  Radius at = equidistant_angle(k, theta);
  for (int i = 1; at.rho < rho; ++i) {
    if (i > kBranchSamples) return kInfinity;
    theta = kMaxAngle * i / kBranchSamples;
    at = equidistant_angle(k, theta);
    if (!(at.slope > 0.0)) return std::nullopt;
  }
  const double above = theta;
  for (int i = 0; i < kMaxIterations && std::abs(at.rho - rho) > kExact; ++i) {
    theta = std::clamp(theta - (at.rho - rho) / at.slope, 0.0, above);
    at = equidistant_angle(k, theta);
    if (!(at.slope > 0.0)) return std::nullopt;
  }
  if (!(std::abs(at.rho - rho) <= kExact)) return std::nullopt;
  return theta;
}

// r of rho: infinite where the lens images nothing within 85 degrees, empty where it folds over.
std::optional<double> lens_inverse(const CameraModel& camera, double rho) {
  const auto& p = camera.lens_parameters;
  double r = rho;
  switch (camera.lens) {
    case LensModel::kPinhole:
      break;
    case LensModel::kEquidistant: {
      const auto theta = equidistant_inverse(p, rho);
      if (!theta) return std::nullopt;
      r = *theta <= kMaxAngle ? std::tan(*theta) : kInfinity;
      break;
    }
    case LensModel::kEucm: {  // eq. (4) of Khomutenko et al.
      const auto [alpha, beta] = std::pair(p[0], p[1]);
      const double root2 = 1.0 - (2.0 * alpha - 1.0) * beta * rho * rho;
      if (!(root2 >= 0.0)) return kInfinity;
      const double z =
          (1.0 - beta * alpha * alpha * rho * rho) / (alpha * std::sqrt(root2) + 1.0 - alpha);
      r = z > 0.0 ? rho / z : kInfinity;
      break;
    }
    case LensModel::kDoubleSphere: {  // eqs. (46) to (50) of Usenko et al.
      const auto [xi, alpha] = std::pair(p[0], p[1]);
      const double root2 = 1.0 - (2.0 * alpha - 1.0) * rho * rho;
      if (!(root2 >= 0.0)) return kInfinity;
      const double mz =
          (1.0 - alpha * alpha * rho * rho) / (alpha * std::sqrt(root2) + 1.0 - alpha);
      const double length2 = mz * mz + rho * rho;
      const double inner2 = mz * mz + (1.0 - xi * xi) * rho * rho;
      if (!(inner2 >= 0.0)) return kInfinity;
      const double scale = (mz * xi + std::sqrt(inner2)) / length2;
      const double z = scale * mz - xi;
      r = z > 0.0 ? scale * rho / z : kInfinity;
      break;
    }
  }
  return r <= kMaxRadius ? r : kInfinity;
}

// --- radial-tangential distortion of m ---

// A function of s and its derivative.
struct ValueAndSlope {
  double value;
  double slope;
};

ValueAndSlope polynomial(double a, double b, double c, double s) {
  return {1.0 + s * (a + s * (b + s * c)), a + s * (2.0 * b + s * 3.0 * c)};
}

// The factor of m, and its derivative by s.
ValueAndSlope radial_of(const Radtan& k, double s) {
  const ValueAndSlope above = polynomial(k[0], k[1], k[4], s);
  const ValueAndSlope below = polynomial(k[5], k[6], k[7], s);
  const double factor = above.value / below.value;
  return {factor, (above.slope - factor * below.slope) / below.value};
}

bool is_straight(const Radtan& k) {
  return std::all_of(k.begin(), k.end(), [](double value) { return value == 0.0; });
}

Vector2d distorted(const Radtan& k, const Vector2d& m) {
  const double s = m.squaredNorm();
  const double radial = radial_of(k, s).value;
  const double xy = 2.0 * m.x() * m.y();
  return {radial * m.x() + k[2] * xy + k[3] * (s + 2.0 * m.x() * m.x()),
          radial * m.y() + k[2] * (s + 2.0 * m.y() * m.y()) + k[3] * xy};
}

Matrix2d distortion_jacobian(const Radtan& k, const Vector2d& m) {
  const double x = m.x();
  const double y = m.y();
  const ValueAndSlope radial = radial_of(k, m.squaredNorm());
  const double slope = 2.0 * radial.slope;
  const double cross = slope * x * y + 2.0 * (k[2] * x + k[3] * y);
  Matrix2d J;
  J << radial.value + slope * x * x + 2.0 * k[2] * y + 6.0 * k[3] * x, cross, cross,
      radial.value + slope * y * y + 6.0 * k[2] * y + 2.0 * k[3] * x;
  return J;
}

// True if the radial part increases from the axis to |m|; the tangential part is small beside it.
bool is_on_first_branch(const Radtan& k, const Vector2d& m) {
  const double last = m.squaredNorm();
  // Near the axis the bound decides, without samples: the slope is 1 + 3 k1 s + 5 k2 s^2 + 7 k3
  // s^3.
  const bool is_rational = k[5] != 0.0 || k[6] != 0.0 || k[7] != 0.0;
  const double bound =
      last * (3.0 * std::abs(k[0]) + last * (5.0 * std::abs(k[1]) + last * 7.0 * std::abs(k[4])));
  if (!is_rational && bound < 1.0) return true;
  for (int i = 1; i <= kBranchSamples; ++i) {
    const double s = last * i / kBranchSamples;
    const ValueAndSlope above = polynomial(k[0], k[1], k[4], s);
    const ValueAndSlope below = polynomial(k[5], k[6], k[7], s);
    // The slope of r radial(r^2), times below^2.
    const double slope = above.value * below.value +
                         2.0 * s * (above.slope * below.value - above.value * below.slope);
    if (!(below.value > 0.0 && slope > 0.0)) return false;
  }
  return true;
}

// m of d by Newton's method, each step halved until it improves.
std::optional<Vector2d> straightened(const Radtan& k, const Vector2d& wanted) {
  if (is_straight(k)) return wanted;
  Vector2d m = wanted;
  for (int i = 0; i < kMaxHalvings && !is_on_first_branch(k, m); ++i) m *= 0.5;
  Vector2d error = distorted(k, m) - wanted;
  for (int i = 0; i < kMaxIterations && error.norm() >= kExact; ++i) {
    const Matrix2d J = distortion_jacobian(k, m);
    if (!(J.determinant() > 0.0)) return std::nullopt;  // beyond the fold of the image
    Vector2d step = J.inverse() * error;
    Vector2d next = m - step;
    for (int halving = 0; halving < kMaxHalvings; ++halving) {
      if ((distorted(k, next) - wanted).norm() < error.norm()) break;
      step *= 0.5;
      next = m - step;
    }
    m = next;
    error = distorted(k, m) - wanted;
  }
  if (!(error.norm() < kExact) || !is_on_first_branch(k, m)) return std::nullopt;
  return m;
}

// --- all of it ---

Vector2d through_port(const CameraModel& camera, const Vector2d& n) {
  if (camera.refractive_index == 1.0) return n;
  const double r = n.norm();
  return r > 0.0 ? Vector2d(n * (port_radius(camera.refractive_index, r).rho / r)) : n;
}

// `n`: in the air.
Vector2d through_lens(const CameraModel& camera, const Vector2d& n) {
  if (camera.lens == LensModel::kPinhole) return n;
  const double r = n.norm();
  return r > 0.0 ? Vector2d(n * (lens_radius(camera, r).rho / r)) : n;
}

// Of n rho / r at n.
Matrix2d radial_jacobian(const Radius& radius, const Vector2d& n) {
  const double r = n.norm();
  if (!(r > 0.0)) return radius.slope * Matrix2d::Identity();
  const double g = radius.rho / r;
  const Vector2d along = n / r;
  return g * Matrix2d::Identity() + (radius.slope - g) * along * along.transpose();
}

// d pixel / d n, n in the air.
Matrix2d jacobian_in_air(const CameraModel& camera, const Vector2d& n) {
  Matrix2d J = Matrix2d::Identity();
  if (camera.lens != LensModel::kPinhole) J = radial_jacobian(lens_radius(camera, n.norm()), n);
  return Vector2d(camera.fx, camera.fy).asDiagonal() *
         distortion_jacobian(camera.radtan, through_lens(camera, n)) * J;
}

// `n`: in the air.
bool is_on_first_branch(const CameraModel& camera, const Vector2d& n) {
  if (camera.lens == LensModel::kEquidistant) {
    const double theta = std::atan(n.norm());
    for (int i = 1; i <= kBranchSamples; ++i) {
      const double part = theta * i / kBranchSamples;
      if (!(equidistant_angle(camera.lens_parameters, part).slope > 0.0)) return false;
    }
  }
  return is_straight(camera.radtan) || is_on_first_branch(camera.radtan, through_lens(camera, n));
}

// n of a pixel: not finite where the lens images nothing, empty where it folds over.
std::optional<Vector2d> ray_of(const CameraModel& camera, const Vector2d& pixel) {
  const Vector2d d((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  auto m = straightened(camera.radtan, d);
  if (!m) return std::nullopt;
  const double rho = m->norm();
  auto r = lens_inverse(camera, rho);
  if (!r) return std::nullopt;
  const bool has_port = camera.refractive_index != 1.0;
  if (camera.lens == LensModel::kPinhole && std::isfinite(*r) && !has_port) return m;
  if (has_port) r = port_inverse(camera.refractive_index, *r);
  return rho > 0.0 ? Vector2d(*m * (*r / rho)) : *m;
}

std::string lens_problem(const CameraModel& camera) {
  const auto& p = camera.lens_parameters;
  const bool is_in_range =
      std::all_of(p.begin(), p.end(), [](double value) { return std::abs(value) <= kMaxRadtan; });
  if (!is_in_range) {
    return fmt::format("lens parameters of {}, {}, {}, {}; each must be within {}", p[0], p[1],
                       p[2], p[3], kMaxRadtan);
  }
  if (camera.lens == LensModel::kEucm && !(p[0] >= 0.0 && p[0] <= 1.0 && p[1] > 0.0)) {
    return fmt::format(
        "an EUCM lens of alpha {} and beta {}; alpha must be from 0 to 1, beta above 0", p[0],
        p[1]);
  }
  if (camera.lens == LensModel::kDoubleSphere &&
      !(p[0] > -1.0 && p[0] <= 1.0 && p[1] >= 0.0 && p[1] <= 1.0)) {
    return fmt::format(
        "a double sphere lens of xi {} and alpha {}; xi must be above -1 and at most 1, alpha from "
        "0 to 1",
        p[0], p[1]);
  }
  return {};
}

// Along the ellipse that touches the edges of the image.
std::string fold_problem(const CameraModel& camera) {
  constexpr int kDirections = 16;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * M_PI * i / kDirections;
    const Vector2d pixel(0.5 * (camera.width - 1) * (1.0 + std::cos(angle)),
                         0.5 * (camera.height - 1) * (1.0 + std::sin(angle)));
    if (ray_of(camera, pixel)) continue;
    return fmt::format(
        "its distortion folds over before pixel ({:.0f}, {:.0f}); check the order and number of "
        "the coefficients",
        pixel.x(), pixel.y());
  }
  return {};
}

}  // namespace

std::string CameraModel::validate() const {
  if (width < 16 || height < 16 || width > 20'000 || height > 20'000) {
    return fmt::format("an image of {} x {} pixels; each must be from 16 to 20000", width, height);
  }
  if (!(fx > 1.0 && fx < 1e6 && fy > 1.0 && fy < 1e6)) {
    return fmt::format("focal lengths of {} and {} pixels; each must be from 1 to 1e6", fx, fy);
  }
  if (!std::isfinite(cx) || !std::isfinite(cy)) return "its principal point is not a number";
  for (const double k : radtan) {
    if (!(std::abs(k) <= kMaxRadtan)) return fmt::format("a distortion coefficient of {}", k);
  }
  if (!X_BC.is_finite()) return "its pose in the body is not finite";
  if (!(refractive_index >= 1.0 && refractive_index <= kMaxIndex)) {
    return fmt::format("a refractive index of {}; water has 1.33 to 1.35, and 1 is no port",
                       refractive_index);
  }
  if (!(line_time_s >= 0.0 && line_time_s * height <= kLongestReadout)) {
    return fmt::format("a line time of {} s; the {} rows must take at most {} s", line_time_s,
                       height, kLongestReadout);
  }
  if (std::string problem = lens_problem(*this); !problem.empty()) return problem;
  return fold_problem(*this);
}

Vector2d CameraModel::distort(const Vector2d& normalised) const {
  const Vector2d m = through_lens(*this, through_port(*this, normalised));
  const Vector2d d = is_straight(radtan) ? m : distorted(radtan, m);
  return {fx * d.x() + cx, fy * d.y() + cy};
}

Matrix2d CameraModel::jacobian(const Vector2d& normalised) const {
  Matrix2d J = jacobian_in_air(*this, through_port(*this, normalised));
  if (refractive_index != 1.0) {
    J *= radial_jacobian(port_radius(refractive_index, normalised.norm()), normalised);
  }
  return J;
}

Eigen::Matrix<double, 2, 5> CameraModel::intrinsics_jacobian(const Vector2d& normalised) const {
  const Vector2d pixel = distort(normalised);
  Eigen::Matrix<double, 2, 5> J = Eigen::Matrix<double, 2, 5>::Zero();
  J(0, 0) = (pixel.x() - cx) / fx;
  J(1, 1) = (pixel.y() - cy) / fy;
  J(0, 2) = J(1, 3) = 1.0;
  if (const double r = normalised.norm(); r > 0.0) {
    J.col(4) = jacobian_in_air(*this, through_port(*this, normalised)) * normalised *
               (port_index_slope(refractive_index, r) / r);
  }
  return J;
}

std::optional<Vector2d> CameraModel::undistort(const Vector2d& pixel) const {
  auto n = ray_of(*this, pixel);
  if (n && !n->allFinite()) return std::nullopt;
  return n;
}

std::optional<Vector2d> CameraModel::project(const Eigen::Vector3d& p_C) const {
  if (!(p_C.z() > kNear)) return std::nullopt;
  const Vector2d n = p_C.head<2>() / p_C.z();
  const Vector2d in_air = through_port(*this, n);
  constexpr double kMost = kMaxRadius * kMaxRadius;
  if (!(n.squaredNorm() <= kMost && in_air.squaredNorm() <= kMost)) return std::nullopt;
  if (!is_on_first_branch(*this, in_air)) return std::nullopt;
  return distort(n);
}

bool CameraModel::in_image(const Vector2d& pixel, double border) const {
  return pixel.x() >= border - 0.5 && pixel.y() >= border - 0.5 &&
         pixel.x() <= width - 0.5 - border && pixel.y() <= height - 0.5 - border;
}

double CameraModel::focal() const { return std::sqrt(jacobian(Vector2d::Zero()).determinant()); }

}  // namespace dive
