#pragma once
// What water does to light, in three bands: red, green, blue (about 620, 540 and 460 nm).
//
// Along a path of length d, from a surface of albedo a to a lens at depth h that looks along a unit
// vector with vertical component s (up positive), the radiance that arrives in one band is
//
//   L = a E exp(-beta_D d)  +  b E_0 exp(-K h) (1 - exp(-(beta_B - K s) d)) / (beta_B - K s)
//
// the revised image formation model of Akkaynak and Treibitz (CVPR 2018), in which the veil closes
// with a coefficient of its own, beta_B, instead of that of the direct light, beta_D; its limit for
// a level ray is their B_inf = b E / beta_B. E_0 is the daylight just below the surface, K the
// diffuse attenuation with depth. E is what falls on the surface: daylight E_0 exp(-K h_surface),
// and the lamps'. Radiances are in units in which a white surface in daylight E_0 = 1 has 1.
//
// Lamps and their veil follow the component model of Jaffe (IEEE J. Oceanic Eng. 15(2), 1990): a
// lamp at distance r lights a surface by P g(theta) cos(incidence) exp(-beta_D r) / r^2, and the
// water before it by the same without the cosine, times the lamps' own b, summed along the line of
// sight. Of his forward
// scatter the halo remains: a share 1 - exp(-halo_per_m d) of what comes from distance d arrives
// blurred by a Gaussian.
//
// Not modelled: refraction at the port (the pinhole is the effective one, under water), shadows of
// the lamps, motion blur.

#include <string>
#include <vector>

#include <Eigen/Core>

namespace dive::vehicle {

using Bands = Eigen::Array3d;  ///< Red, green, blue.

struct WaterOptics {
  Bands beam = {0.45, 0.20, 0.22};                 ///< beta_D, 1/m.
  Bands veil = {0.50, 0.22, 0.24};                 ///< beta_B, 1/m.
  Bands backscatter = {0.012, 0.012, 0.012};       ///< b, 1/m: B_inf beta_B / E, of daylight.
  Bands lamp_backscatter = {0.003, 0.003, 0.003};  ///< The same of lamps: straight back, and once.
  Bands downwelling = {0.40, 0.12, 0.14};          ///< K, 1/m.
  Bands daylight = {1.0, 1.0, 1.0};                ///< E_0; 1 at noon, 0 at night.
  double halo_per_m = 0.05;                        ///< Forward scatter.
  double halo_sigma_px = 2.0;
  double caustics = 0.6;          ///< Relative strength just below the surface ...
  double caustics_depth_m = 4.0;  ///< ... which falls to 1/e over this depth.
  // Marine snow.
  double snow_per_m3 = 15.0;
  double snow_radius_m = 0.0007;  ///< Median; they are log-normal with a factor of 1.6.
  double snow_speed = 0.02;       ///< m/s through the water, in a direction of its own for each.

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

/// Fixed to the vehicle.
struct Lamp {
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_B = Eigen::Vector3d::UnitX();
  double power = 1.0;            ///< P: radiance of a white surface 1 m before it, in clear water.
  double half_angle_deg = 45.0;  ///< Where it has half its power; g falls smoothly around that.

  [[nodiscard]] std::string validate() const;
};

/// Two floodlights at the bow, outside of the cameras, that look where they look.
[[nodiscard]] std::vector<Lamp> bow_lamps();

/// Conditions by name.
[[nodiscard]] WaterOptics clear_pool();
[[nodiscard]] WaterOptics coastal_sea();
[[nodiscard]] WaterOptics green_lake();
/// Coastal water by night, or far inside: what is seen is seen by the lamps.
[[nodiscard]] WaterOptics dark_wreck();

}  // namespace dive::vehicle
