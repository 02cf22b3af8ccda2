#include "vehicle/simulator/water/water_optics.h"

#include <cmath>

#include "common/range_check.h"
#include "common/se3.h"

namespace dive::vehicle {
namespace {}  // namespace

std::string WaterOptics::validate() const {
  RangeCheck check;
  check("beam.red", beam[0], 0, 20);
  check("beam.green", beam[1], 0, 20);
  check("beam.blue", beam[2], 0, 20);
  check("veil.red", veil[0], 0, 20);
  check("veil.green", veil[1], 0, 20);
  check("veil.blue", veil[2], 0, 20);
  check("backscatter.red", backscatter[0], 0, 5);
  check("backscatter.green", backscatter[1], 0, 5);
  check("backscatter.blue", backscatter[2], 0, 5);
  check("lamp_backscatter.red", lamp_backscatter[0], 0, 5);
  check("lamp_backscatter.green", lamp_backscatter[1], 0, 5);
  check("lamp_backscatter.blue", lamp_backscatter[2], 0, 5);
  check("downwelling.red", downwelling[0], 0, 20);
  check("downwelling.green", downwelling[1], 0, 20);
  check("downwelling.blue", downwelling[2], 0, 20);
  check("daylight.red", daylight[0], 0, 10);
  check("daylight.green", daylight[1], 0, 10);
  check("daylight.blue", daylight[2], 0, 10);
  check("halo_per_m", halo_per_m, 0, 10);
  check("halo_sigma_px", halo_sigma_px, 0, 8);
  check("caustics", caustics, 0, 1);
  check("caustics_depth_m", caustics_depth_m, 0.1, 100);
  check("snow_per_m3", snow_per_m3, 0, 500);
  check("snow_radius_m", snow_radius_m, 0, 0.02);
  check("snow_speed", snow_speed, 0, 10);
  return check.problem();
}

std::string Lamp::validate() const {
  RangeCheck check;
  check("a lamp's distance from the vehicle's origin", p_B.norm(), 0, 10);
  check("the length of a lamp's direction", direction_B.norm(), 1e-6, 1e6);
  check("a lamp's power", power, 0, 1000);
  check("a lamp's half_angle_deg", half_angle_deg, 1, 90);
  check("a lamp's direction", direction_B.sum(), -1e7, 1e7);
  return check.problem();
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
