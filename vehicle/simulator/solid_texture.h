#pragma once
// What surfaces look like: solid textures, which fill space and are cut by the surfaces (Perlin
// 1985, Peachey 1985), so that nothing has to be unwrapped and a point keeps its colour wherever it
// is seen from.
//
// Seven octaves of value noise, spacings from 1 m to 8 mm. An octave fades as its spacing nears the
// width of a pixel on the surface and is gone where it is no wider than one: finer texture would
// only alias, and aliases do not move with the world.

#include <string>

#include "vehicle/simulator/ray_batch.h"

namespace dive::vehicle {

/// 0 is no surface at all.
enum class Look { kNone, kSand, kRust, kPaint, kConcrete, kSuit, kPrint };

/// By the name that a map gives a thing: seabed, ground, sand and bottom are sand; pool, basin,
/// floor, wall and quay are concrete; the rest is rusty or painted, each name always the same.
/// `is_ground`: a plane that faces up, sand unless its name says otherwise.
[[nodiscard]] Look look_of(const std::string& name, bool is_ground);

/// Its albedo is so many times that of its look, 0.75 to 1.25 by its name.
[[nodiscard]] float tone_of(const std::string& name);

/// The share of an octave of noise of this spacing that a pixel of this footprint shows.
DIVE_INLINE float octave_share(float spacing, float footprint) {
  const float t = std::clamp((spacing - footprint) / (1.2F * footprint), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

/// Fills in red, green and blue.
void paint(RayBatch& rays);

}  // namespace dive::vehicle
