#include <array>
#include <cmath>

#include "common/range_check.h"
#include "vehicle/simulator/sensors/sensors.h"
#include "vehicle/simulator/simulator.h"

namespace dive::vehicle {
namespace {

struct Entry {
  const char* name;
  double& (*of)(Conditions&);
  double low;
  double high;
};

// One row per condition: name, member, range.
constexpr std::array<Entry, 26> kEntries{{
    {"current_x", [](Conditions& c) -> double& { return c.current_W.x(); }, -3.0, 3.0},
    {"current_y", [](Conditions& c) -> double& { return c.current_W.y(); }, -3.0, 3.0},
    {"current_z", [](Conditions& c) -> double& { return c.current_W.z(); }, -3.0, 3.0},
    {"current_sigma", [](Conditions& c) -> double& { return c.current_sigma; }, 0.0, 1.0},
    {"speed_scale_sigma", [](Conditions& c) -> double& { return c.speed_scale_sigma; }, 0.0, 0.2},
    {"heading_bias_sigma_deg", [](Conditions& c) -> double& { return c.heading_bias_sigma_deg; },
     0.0, 45.0},
    {"heading_variation_deg", [](Conditions& c) -> double& { return c.heading_variation_deg; }, 0.0,
     45.0},
    {"tilt_bias_sigma_deg", [](Conditions& c) -> double& { return c.tilt_bias_sigma_deg; }, 0.0,
     10.0},
    {"gyro_bias_sigma", [](Conditions& c) -> double& { return c.gyro_bias_sigma; }, 0.0, 0.2},
    {"depth_bias_sigma_m", [](Conditions& c) -> double& { return c.depth_bias_sigma_m; }, 0.0, 2.0},
    {"hull_scatter", [](Conditions& c) -> double& { return c.hull_scatter; }, 0.0, 0.5},
    {"buoyancy_sigma_n", [](Conditions& c) -> double& { return c.buoyancy_sigma_n; }, 0.0, 5.0},
    {"hull_seed", [](Conditions& c) -> double& { return c.hull_seed; }, 0.0, 999'999'999.0},
    {"start_sigma_m", [](Conditions& c) -> double& { return c.start_sigma_m; }, 0.0, 5.0},
    {"map_shift_sigma_m", [](Conditions& c) -> double& { return c.map_shift_sigma_m; }, 0.0, 10.0},
    {"map_turn_sigma_deg", [](Conditions& c) -> double& { return c.map_turn_sigma_deg; }, 0.0,
     45.0},
    {"object_shift_sigma_m", [](Conditions& c) -> double& { return c.object_shift_sigma_m; }, 0.0,
     5.0},
    {"range_misalignment_sigma_deg",
     [](Conditions& c) -> double& { return c.range_misalignment_sigma_deg; }, 0.0, 20.0},
    {"attitude_noise_deg", [](Conditions& c) -> double& { return c.attitude_noise_deg; }, 0.0,
     10.0},
    {"gyro_noise", [](Conditions& c) -> double& { return c.gyro_noise; }, 0.0, 1.0},
    {"accel_noise", [](Conditions& c) -> double& { return c.accel_noise; }, 0.0, 10.0},
    {"depth_noise_m", [](Conditions& c) -> double& { return c.depth_noise_m; }, 0.0, 1.0},
    {"sensor_latency_s", [](Conditions& c) -> double& { return c.sensor_latency_s; }, 0.0,
     Sensors::kMaxLatency},
    {"battery_capacity_wh", [](Conditions& c) -> double& { return c.battery_capacity_wh; }, 1.0,
     10'000.0},
    {"battery_voltage", [](Conditions& c) -> double& { return c.battery_voltage; }, 1.0, 1000.0},
    {"battery_fraction", [](Conditions& c) -> double& { return c.battery_fraction; }, 0.0, 1.0},
}};

}  // namespace

Eigen::Vector3d Conditions::first_current_W() const {
  Eigen::Vector3d first_W = current_W;
  first_W.head<2>() += declared_current.at(0.0);
  return first_W;
}

bool Conditions::set(const std::string& name, double value) {
  for (const Entry& entry : kEntries) {
    if (name != entry.name) continue;
    entry.of(*this) = value;
    return true;
  }
  return false;
}

std::vector<std::pair<std::string, double>> Conditions::list() const {
  Conditions copy = *this;
  std::vector<std::pair<std::string, double>> result;
  for (const Entry& entry : kEntries) result.emplace_back(entry.name, entry.of(copy));
  return result;
}

std::string Conditions::validate() const {
  Conditions copy = *this;
  RangeCheck check;
  for (const Entry& entry : kEntries) {
    check(entry.name, entry.of(copy), entry.low, entry.high);
  }
  if (!check.problem().empty()) return check.problem();
  if (inertial_unit) return inertial_unit->validate();
  return {};
}

}  // namespace dive::vehicle
