#include "common/motion_model.h"

#include <array>

#include "common/range_check.h"

namespace dive {
namespace {

using M = MotionModel;

constexpr std::array<MotionCoefficient, 17> kCoefficients{{
    {"full_speed", "m/s", "steady speed at full surge effort", 0.05, 5.0,
     [](M& m) -> double& { return m.full_speed; }},
    {"full_heave", "m/s", "steady heave at full heave effort", 0.01, 5.0,
     [](M& m) -> double& { return m.full_heave; }},
    {"thrust_lag_s", "s", "lag of thrust and sensors", 0.0, 10.0,
     [](M& m) -> double& { return m.thrust_lag_s; }},
    {"surge_coast_m", "m", "mass over drag, surge", 0.1, 100.0,
     [](M& m) -> double& { return m.coast_m.x(); }},
    {"sway_coast_m", "m", "mass over drag, sway", 0.1, 100.0,
     [](M& m) -> double& { return m.coast_m.y(); }},
    {"heave_coast_m", "m", "mass over drag, heave", 0.1, 100.0,
     [](M& m) -> double& { return m.coast_m.z(); }},
    {"sway_mass_ratio", "", "surge mass over sway mass", 0.1, 10.0,
     [](M& m) -> double& { return m.sway_mass_ratio; }},
    {"heave_mass_ratio", "", "surge mass over heave mass", 0.1, 10.0,
     [](M& m) -> double& { return m.heave_mass_ratio; }},
    {"sway_tail_lift_m", "m", "mass over the tail's added mass per length, sway", 0.1, 1e6,
     [](M& m) -> double& { return m.tail_lift_m.x(); }},
    {"heave_tail_lift_m", "m", "mass over the tail's added mass per length, heave", 0.1, 1e6,
     [](M& m) -> double& { return m.tail_lift_m.y(); }},
    {"tail_m", "m", "tail behind B's origin", 0.0, 10.0, [](M& m) -> double& { return m.tail_m; }},
    {"buoyancy", "m/s^2", "net buoyancy over surge mass", -1.0, 1.0,
     [](M& m) -> double& { return m.buoyancy; }},
    {"slip_surge", "m/s", "slip along x of B, one sigma", 0.001, 5.0,
     [](M& m) -> double& { return m.slip_sigma.x(); }},
    {"slip_sway", "m/s", "slip along y of B, one sigma", 0.001, 5.0,
     [](M& m) -> double& { return m.slip_sigma.y(); }},
    {"slip_heave", "m/s", "slip along z of B, one sigma", 0.001, 5.0,
     [](M& m) -> double& { return m.slip_sigma.z(); }},
    {"slip_time_s", "s", "correlation time of the slip", 0.1, 1000.0,
     [](M& m) -> double& { return m.slip_time_s; }},
    {"speed_time_constant_s", "s", "time constant of the speed reference", 0.05, 60.0,
     [](M& m) -> double& { return m.speed_time_constant_s; }},
}};

}  // namespace

std::span<const MotionCoefficient> motion_coefficients() { return kCoefficients; }

std::string MotionModel::validate() const {
  RangeCheck check;
  for (const MotionCoefficient& c : kCoefficients) check(c.name, c.value(*this), c.low, c.high);
  return check.problem();
}

}  // namespace dive
