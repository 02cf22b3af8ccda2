#include "vehicle/simulator/dynamics/dynamics.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"

namespace dive::vehicle {
namespace {

using Eigen::Vector3d;

Vector6d wrench(const Vector3d& force, const Vector3d& moment) {
  Vector6d result;
  result << force, moment;
  return result;
}

Vector6d wrench_at(const Vector3d& point, const Vector3d& force) {
  return wrench(force, point.cross(force));
}

Vector3d signed_square(const Vector3d& x) { return x.cwiseAbs().cwiseProduct(x); }

// Fossen (3.27): mass matrix of a rigid body about a point that is not its centre of mass.
Matrix6d rigid_body_mass(double mass, const Vector3d& centre, const Eigen::Matrix3d& inertia) {
  const Eigen::Matrix3d S = skew(centre);
  Matrix6d M;
  M << mass * Eigen::Matrix3d::Identity(), -mass * S, mass * S, inertia - mass * S * S;
  return M;
}

// Drag of a flat box rotating about each axis: its two pairs of long faces, strip by strip.
Vector3d turning_drag(const Aqua2Figures& figures) {
  Vector3d result;
  const Vector3d& size = figures.shell_size;
  const Vector3d& C = figures.body_drag;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    result[i] = figures.water_density * size[i] *
                (C[k] * std::pow(size[j], 4) + C[j] * std::pow(size[k], 4)) / 64.0;
  }
  return result;
}

}  // namespace

Dynamics::Dynamics(const Model& model, const Aqua2Figures& figures)
    : figures_(figures), hips_B_(model.hips_B), centre_of_mass_B_(model.centre_of_mass_B) {
  DIVE_DEMAND(model.mass_kg > 0.0 && model.inertia_B.allFinite() && hips_B_.allFinite());
  const double rho = figures.water_density;
  const Vector3d& size = figures.shell_size;
  weight_ = model.mass_kg * kGravity;
  buoyancy_ = (model.mass_kg + figures.spare_buoyancy_kg) * kGravity;
  const Vector3d centre_of_buoyancy =
      centre_of_mass_B_ + Vector3d(0.0, 0.0, figures.metacentric_height);
  for (int i = 0; i < kElements; ++i) {
    const Vector3d offset(size.x() / 3.0 * (i % 3 - 1), size.y() / 4.0 * (i < 3 ? 1 : -1), 0.0);
    elements_B_[static_cast<std::size_t>(i)] = centre_of_buoyancy + offset;
  }
  const Vector3d faces(size.y() * size.z(), size.x() * size.z(), size.x() * size.y());
  linear_drag_ = 0.5 * rho * figures.body_drag.cwiseProduct(faces);
  angular_drag_ = turning_drag(figures);
  flipper_drag_ = 0.5 * rho * figures.flipper_drag * figures.flipper_length * figures.flipper_width;
  tail_mass_ =
      figures.tail_lift / size.x() * Vector3d(0.0, figures.added_mass[1], figures.added_mass[2]);
  mass_ = rigid_body_mass(model.mass_kg, centre_of_mass_B_, model.inertia_B);
  mass_ += figures.added_mass.asDiagonal();
  const Eigen::LDLT<Matrix6d> factor(mass_);
  DIVE_DEMAND(factor.isPositive());
  inverse_mass_ = factor.solve(Matrix6d::Identity());
}

double Dynamics::submerged(double z, double height) const {
  return std::clamp(0.5 - z / height, 0.0, 1.0);
}

double Dynamics::submerged(const Pose& X_WB) const {
  double sum = 0.0;
  for (const Vector3d& element : elements_B_) {
    sum += submerged((X_WB * element).z(), figures_.shell_size.z());
  }
  return sum / kElements;
}

Vector6d Dynamics::weight_and_buoyancy(const Pose& X_WB) const {
  const Vector3d up_B = X_WB.q.conjugate() * Vector3d::UnitZ();
  Vector6d total = wrench_at(centre_of_mass_B_, -weight_ * up_B);
  for (const Vector3d& element : elements_B_) {
    const double share = submerged((X_WB * element).z(), figures_.shell_size.z());
    total += wrench_at(element, buoyancy_ / kElements * share * up_B);
  }
  return total;
}

Vector6d Dynamics::drag(const State& state) const {
  Vector6d total = wrench(-linear_drag_.cwiseProduct(signed_square(state.v)),
                          -angular_drag_.cwiseProduct(signed_square(state.omega)));
  for (int i = 0; i < hips_B_.cols(); ++i) {
    const Vector3d hip = hips_B_.col(i);
    const double w = state.v.z() + state.omega.cross(hip).z();
    total += wrench_at(hip, Vector3d(0.0, 0.0, -flipper_drag_ * std::abs(w) * w));
  }
  return total;
}

// Water leaves the blunt tail with the lateral momentum that it has there: per second,
// |u| times the section's added mass times the tail's lateral velocity (Lighthill 1960).
Vector6d Dynamics::tail_lift(const State& state) const {
  const double u = state.v.x();
  const Vector3d tail(u >= 0.0 ? -0.5 * figures_.shell_size.x() : 0.5 * figures_.shell_size.x(),
                      0.0, 0.0);
  const Vector3d v_tail = state.v + state.omega.cross(tail);
  return wrench_at(tail, -std::abs(u) * tail_mass_.cwiseProduct(v_tail));
}

Vector6d Dynamics::flippers(const State& state, const FlipperForces& forces) const {
  Vector6d total = Vector6d::Zero();
  for (int i = 0; i < hips_B_.cols(); ++i) {
    const Vector3d hip = hips_B_.col(i);
    const double share = submerged((state.X_WB * hip).z(), figures_.shell_size.z());
    total += wrench_at(hip, share * forces.col(i));
  }
  return total;
}

Vector6d Dynamics::acceleration(const State& state, const FlipperForces& forces) const {
  const Vector6d momentum = mass_ * wrench(state.v, state.omega);
  const Vector3d p = momentum.head<3>();
  const Vector3d l = momentum.tail<3>();
  const Vector6d transport = wrench(state.omega.cross(p), state.omega.cross(l) + state.v.cross(p));
  Vector6d tau = weight_and_buoyancy(state.X_WB);
  tau += submerged(state.X_WB) * (drag(state) + tail_lift(state));
  tau += flippers(state, forces);
  return inverse_mass_ * (tau - transport);
}

double Dynamics::kinetic_energy(const State& state) const {
  const Vector6d nu = wrench(state.v, state.omega);
  return 0.5 * nu.dot(mass_ * nu);
}

void Dynamics::advance(State& state, const FlipperForces& forces, const Vector3d& current_W,
                       double dt) const {
  struct Rate {
    Vector3d p;
    Eigen::Vector4d q;
    Vector6d nu;
  };
  const auto rate = [&](const State& s) {
    const Eigen::Quaterniond turn(0.0, 0.5 * s.omega.x(), 0.5 * s.omega.y(), 0.5 * s.omega.z());
    return Rate{s.X_WB.q * s.v + current_W, (s.X_WB.q * turn).coeffs(), acceleration(s, forces)};
  };
  const auto moved = [&state](const Rate& r, double h) {
    State s = state;
    s.X_WB.p += h * r.p;
    s.X_WB.q.coeffs() += h * r.q;
    s.X_WB.q.normalize();
    s.v += h * r.nu.head<3>();
    s.omega += h * r.nu.tail<3>();
    return s;
  };
  const Rate a = rate(state);
  const Rate b = rate(moved(a, 0.5 * dt));
  const Rate c = rate(moved(b, 0.5 * dt));
  const Rate d = rate(moved(c, dt));
  const Rate mean{(a.p + 2.0 * b.p + 2.0 * c.p + d.p) / 6.0,
                  (a.q + 2.0 * b.q + 2.0 * c.q + d.q) / 6.0,
                  (a.nu + 2.0 * b.nu + 2.0 * c.nu + d.nu) / 6.0};
  state = moved(mean, dt);
}

}  // namespace dive::vehicle
