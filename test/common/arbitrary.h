#pragma once
// Generators of poses for property tests, including tiny angles and angles near pi.

#include <cmath>

#include <Eigen/Core>
#include <rapidcheck.h>

#include "common/se3.h"

namespace dive::testing {

/// A number in [low, high] from a fine grid.
inline rc::Gen<double> arbitrary_double(double low, double high) {
  return rc::gen::map(rc::gen::inRange(0, 1'000'001),
                      [low, high](int step) { return low + (high - low) * step / 1e6; });
}

inline rc::Gen<Eigen::Vector3d> arbitrary_vector(double bound) {
  return rc::gen::map(
      rc::gen::tuple(arbitrary_double(-bound, bound), arbitrary_double(-bound, bound),
                     arbitrary_double(-bound, bound)),
      [](const std::tuple<double, double, double>& t) {
        return Eigen::Vector3d(std::get<0>(t), std::get<1>(t), std::get<2>(t));
      });
}

inline rc::Gen<Eigen::Vector3d> arbitrary_rotation_vector() {
  return rc::gen::map(rc::gen::tuple(arbitrary_vector(1.0),
                                     rc::gen::element(1e-12, 1e-7, 1e-3, 0.5, 1.7, 3.1, 6.0)),
                      [](const std::tuple<Eigen::Vector3d, double>& t) {
                        const Eigen::Vector3d axis = std::get<0>(t) + Eigen::Vector3d(1e-3, 0, 0);
                        return Eigen::Vector3d(axis.norm() < 1e-9
                                                   ? Eigen::Vector3d(std::get<1>(t), 0, 0)
                                                   : axis.normalized() * std::get<1>(t));
                      });
}

inline rc::Gen<Pose> arbitrary_pose() {
  return rc::gen::map(rc::gen::tuple(arbitrary_vector(20.0), arbitrary_rotation_vector()),
                      [](const std::tuple<Eigen::Vector3d, Eigen::Vector3d>& t) {
                        return Pose{std::get<0>(t), so3_exp(std::get<1>(t))};
                      });
}

}  // namespace dive::testing
