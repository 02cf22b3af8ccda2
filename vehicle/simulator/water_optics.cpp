#include "vehicle/simulator/water_optics.h"

#include <array>
#include <cmath>

#include <fmt/format.h>

#include "common/se3.h"

namespace dive::vehicle {
namespace {

struct Bound {
  const char* name;
  double value;
  double low;
  double high;
};

template <std::size_t N>
std::string first_outside(const std::array<Bound, N>& bounds) {
  for (const auto& [name, value, low, high] : bounds) {
    if (value >= low && value <= high) continue;  // false for NaN
    return fmt::format("{} is {} but must be from {} to {}", name, value, low, high);
  }
  return {};
}

}  // namespace

std::string WaterOptics::validate() const {
  const std::array<Bound, 25> bounds{{
      {"beam.red", beam[0], 0, 20},
      {"beam.green", beam[1], 0, 20},
      {"beam.blue", beam[2], 0, 20},
      {"veil.red", veil[0], 0, 20},
      {"veil.green", veil[1], 0, 20},
      {"veil.blue", veil[2], 0, 20},
      {"backscatter.red", backscatter[0], 0, 5},
      {"backscatter.green", backscatter[1], 0, 5},
      {"backscatter.blue", backscatter[2], 0, 5},
      {"lamp_backscatter.red", lamp_backscatter[0], 0, 5},
      {"lamp_backscatter.green", lamp_backscatter[1], 0, 5},
      {"lamp_backscatter.blue", lamp_backscatter[2], 0, 5},
      {"downwelling.red", downwelling[0], 0, 20},
      {"downwelling.green", downwelling[1], 0, 20},
      {"downwelling.blue", downwelling[2], 0, 20},
      {"daylight.red", daylight[0], 0, 10},
      {"daylight.green", daylight[1], 0, 10},
      {"daylight.blue", daylight[2], 0, 10},
      {"halo_per_m", halo_per_m, 0, 10},
      {"halo_sigma_px", halo_sigma_px, 0, 8},
      {"caustics", caustics, 0, 1},
      {"caustics_depth_m", caustics_depth_m, 0.1, 100},
      {"snow_per_m3", snow_per_m3, 0, 500},
      {"snow_radius_m", snow_radius_m, 0, 0.02},
      {"snow_speed", snow_speed, 0, 10},
  }};
  return first_outside(bounds);
}

std::string Lamp::validate() const {
  const std::array<Bound, 5> bounds{{
      {"a lamp's distance from the vehicle's origin", p_B.norm(), 0, 10},
      {"the length of a lamp's direction", direction_B.norm(), 1e-6, 1e6},
      {"a lamp's power", power, 0, 1000},
      {"a lamp's half_angle_deg", half_angle_deg, 1, 90},
      {"a lamp's direction", direction_B.sum(), -1e7, 1e7},
  }};
  return first_outside(bounds);
}

std::vector<Lamp> bow_lamps() {
  const double tilt = deg_to_rad(40.0);
  std::vector<Lamp> lamps;
  for (const double side : {1.0, -1.0}) {
    Lamp lamp;
    lamp.p_B = {0.30, 0.20 * side, 0.06};
    lamp.direction_B = {std::cos(tilt), 0.12 * side, -std::sin(tilt)};
    lamps.push_back(lamp);
  }
  return lamps;
}

WaterOptics clear_pool() {
  WaterOptics water;
  water.beam = {0.36, 0.09, 0.06};
  water.veil = {0.40, 0.10, 0.07};
  water.backscatter = {0.004, 0.004, 0.004};
  water.lamp_backscatter = {0.001, 0.001, 0.001};
  water.downwelling = {0.33, 0.07, 0.05};
  water.halo_per_m = 0.01;
  water.halo_sigma_px = 1.5;
  water.snow_per_m3 = 0.5;
  return water;
}

WaterOptics coastal_sea() { return {}; }

WaterOptics green_lake() {
  WaterOptics water;
  water.beam = {0.62, 0.40, 0.66};
  water.veil = {0.70, 0.44, 0.74};
  water.backscatter = {0.03, 0.035, 0.03};
  water.lamp_backscatter = {0.008, 0.008, 0.008};
  water.downwelling = {0.55, 0.30, 0.60};
  water.halo_per_m = 0.10;
  water.halo_sigma_px = 2.5;
  water.snow_per_m3 = 40.0;
  return water;
}

WaterOptics dark_wreck() {
  WaterOptics water;
  water.lamp_backscatter = {0.001, 0.001, 0.001};
  water.daylight = {0.0, 0.0, 0.0};
  return water;
}

}  // namespace dive::vehicle
