#pragma once
// The effect of water on light, in three bands: red, green, blue (about 620, 540 and 460 nm).
//
// Along a path of length d, from a surface of albedo a to a lens at depth h, in a viewing direction
// with vertical component s (up positive), the radiance that arrives in one band is
//
//   L = a E exp(-beta_D d)  +  b E_0 exp(-K h) (1 - exp(-(beta_B - K s) d)) / (beta_B - K s)
//
// the revised image formation model of Akkaynak and Treibitz (CVPR 2018), in which the veil has a
// coefficient of its own, beta_B, instead of that of the direct light, beta_D; its limit for a
// level ray is their B_inf = b E / beta_B. E_0 is the daylight just below the surface, K the
// diffuse attenuation with depth. E is the light on the surface: daylight E_0 exp(-K h_surface) and
// that of the lamps. Radiances are in units in which a white surface in daylight E_0 = 1 has 1.
//
// Lamps and their veil follow the component model of Jaffe (IEEE J. Oceanic Eng. 15(2), 1990): a
// lamp at distance r lights a surface by P g(theta) cos(incidence) exp(-beta_D r) / r^2, and the
// water before it by the same without the cosine, times the lamps' own b, summed along the line of
// sight. Of his forward scatter the halo remains: a share 1 - exp(-halo_per_m d) of the light from
// distance d arrives blurred by a Gaussian.
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
  Bands lamp_backscatter = {0.003, 0.003, 0.003};  ///< b of lamps, 1/m: back, single scattering.
  Bands downwelling = {0.40, 0.12, 0.14};          ///< K, 1/m.
  Bands daylight = {1.0, 1.0, 1.0};                ///< E_0; 1 at noon, 0 at night.
  double halo_per_m = 0.05;                        ///< Forward scatter.
  double halo_sigma_px = 2.0;
  double caustics = 0.6;          ///< Relative strength of caustics just below the surface.
  double caustics_depth_m = 4.0;  ///< Depth over which caustics fall to 1/e.
  // Marine snow.
  double snow_per_m3 = 15.0;
  double snow_radius_m = 0.0007;  ///< Median radius; the radii are log-normal with a factor of 1.6.
  double snow_speed = 0.02;       ///< Speed of each in its own direction, m/s, in the water.

  /// A description of the first error; empty if the values are usable.
  [[nodiscard]] std::string validate() const;
};

/// A lamp fixed to the vehicle.
struct Lamp {
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_B = Eigen::Vector3d::UnitX();
  double power = 1.0;            ///< P: radiance of a white surface 1 m before it, in clear water.
  double half_angle_deg = 45.0;  ///< Angle of half its power; g falls smoothly around that.

  [[nodiscard]] std::string validate() const;
};

/// Two floodlights at the bow, outboard of the cameras and parallel to them.
[[nodiscard]] std::vector<Lamp> bow_lamps();

/// Water types by name.
[[nodiscard]] WaterOptics clear_pool();
[[nodiscard]] WaterOptics coastal_sea();
[[nodiscard]] WaterOptics green_lake();
/// Coastal water at night, or far inside a wreck: lit by the lamps only.
[[nodiscard]] WaterOptics dark_wreck();

}  // namespace dive::vehicle
