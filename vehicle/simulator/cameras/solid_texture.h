#pragma once
// Appearance of surfaces: solid textures, which fill space and are cut by the surfaces (Perlin
// 1985, Peachey 1985), so that no surface needs unwrapping and a point has the same colour from
// every viewpoint.
//
// Seven octaves of value noise, spacings from 1 m to 8 mm. An octave fades as its spacing nears the
// width of a pixel on the surface and vanishes where it is no wider than one: finer texture would
// only alias, and aliases do not move with the world.

#include <string>

#include "vehicle/simulator/ray_tracing/ray_batch.h"

namespace dive::vehicle {

/// kNone: no surface.
enum class Texture { kNone, kSand, kRust, kPaint, kConcrete, kSuit, kPrint };

/// Chooses by the obstacle's name in the map: seabed, ground, sand and bottom are sand; pool,
/// basin, floor, wall and quay are concrete; the rest is rusty or painted, always the same for one
/// name. `is_ground`: a plane that faces up, sand unless its name contains another material.
[[nodiscard]] Texture texture_of(const std::string& name, bool is_ground);

/// Factor on the albedo of the surface's texture, 0.75 to 1.25 by its name.
[[nodiscard]] float tone_of(const std::string& name);

/// The visible fraction of an octave of noise of this spacing in a pixel of this footprint.
DIVE_INLINE float octave_share(float spacing, float footprint) {
  const float t = std::clamp((spacing - footprint) / (1.2F * footprint), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

/// Writes red, green and blue.
void paint(RayBatch& rays);

}  // namespace dive::vehicle
