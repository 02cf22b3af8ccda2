#include "vehicle/simulator/cameras/solid_texture.h"

#include <array>
#include <cctype>
#include <string_view>

#include "common/fnv.h"

namespace dive::vehicle {
namespace {

constexpr int kOctaves = 7;
constexpr std::array<float, kOctaves> kSpacing{1.0F, 0.45F, 0.2F, 0.09F, 0.042F, 0.019F, 0.0085F};
using Octaves = std::array<RayBatch::Floats, kOctaves>;

// Base colour, growth or flaking, and spots: shells, pits, pebbles.
struct TextureParameters {
  std::array<float, 3> base;
  std::array<float, 3> growth;
  std::array<float, 3> spot;
  float growth_level;  // level of the coarse noise above which there is growth
  float growth_edge;   // softness of the edge of the growth
  float detail;        // contrast of the fine noise
  float spot_level;
};
constexpr int kTextures = 7;
constexpr std::array<TextureParameters, kTextures> kFigures{{
    {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 2.0F, 0.1F, 0.0F, 2.0F},
    // sand: ripples of dark silt, bits of shell
    {{0.36F, 0.31F, 0.24F},
     {0.17F, 0.16F, 0.12F},
     {0.75F, 0.72F, 0.66F},
     0.12F,
     0.14F,
     0.55F,
     0.52F},
    // rust: dark scale, bright flakes
    {{0.30F, 0.15F, 0.08F},
     {0.10F, 0.11F, 0.08F},
     {0.48F, 0.33F, 0.20F},
     0.02F,
     0.06F,
     0.60F,
     0.38F},
    // paint: grey, overgrown in patches, rusted through in spots
    {{0.38F, 0.39F, 0.37F},
     {0.12F, 0.17F, 0.08F},
     {0.20F, 0.09F, 0.05F},
     0.05F,
     0.05F,
     0.40F,
     0.36F},
    // concrete
    {{0.46F, 0.47F, 0.45F},
     {0.30F, 0.33F, 0.28F},
     {0.20F, 0.20F, 0.19F},
     0.10F,
     0.10F,
     0.38F,
     0.44F},
    // neoprene with a few markings
    {{0.05F, 0.05F, 0.06F},
     {0.08F, 0.08F, 0.09F},
     {0.55F, 0.45F, 0.08F},
     0.10F,
     0.04F,
     0.30F,
     0.55F},
    // print: its tone is its only property
    {{1, 1, 1}, {0, 0, 0}, {0, 0, 0}, 2.0F, 0.1F, 0.0F, 2.0F},
}};

// Noise of one octave, in axes rotated against those of W, because floors and walls would otherwise
// lie in its lattice.
DIVE_VECTOR_LOOP void octave(const RayBatch& rays, float spacing, std::uint32_t seed,
                             RayBatch::Floats& out) {
  const float scale = 1.0F / spacing;
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float x = scale * (0.36F * rays.tx[i] + 0.48F * rays.ty[i] - 0.8F * rays.tz[i]);
    const float y = scale * (-0.8F * rays.tx[i] + 0.6F * rays.ty[i]);
    const float z = scale * (0.48F * rays.tx[i] + 0.64F * rays.ty[i] + 0.6F * rays.tz[i]);
    out[i] = octave_share(spacing, rays.footprint[i]) * value_noise(x, y, z, seed);
  }
}

struct ColumnOf {
  RayBatch::Floats level, edge, detail, spot_level;
  std::array<RayBatch::Floats, 3> base, growth, spot;
};

void gather(const RayBatch& rays, ColumnOf& f) {
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const TextureParameters& texture = kFigures[static_cast<std::size_t>(rays.texture[i])];
    f.level[i] = texture.growth_level;
    f.edge[i] = texture.growth_edge;
    f.detail[i] = texture.detail;
    f.spot_level[i] = texture.spot_level;
    for (std::size_t c = 0; c < 3; ++c) {
      f.base[c][i] = rays.tone[i] * texture.base[c];
      f.growth[c][i] = rays.tone[i] * texture.growth[c];
      f.spot[c][i] = rays.tone[i] * texture.spot[c];
    }
  }
}

DIVE_VECTOR_LOOP void mix(const Octaves& n, const ColumnOf& f, RayBatch& rays) {
  for (int k = 0; k < RayBatch::kSize; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float soft = 3.0F * rays.footprint[i];  // an edge no sharper than a pixel
    const float coarse =
        0.45F * n[0][i] + 0.4F * n[1][i] + 0.3F * n[2][i] + 0.18F * n[3][i] + 0.1F * n[4][i];
    const float growth =
        smooth_step(f.level[i] - f.edge[i] - soft, f.level[i] + f.edge[i] + soft, coarse);
    const float speckle = 0.55F * n[3][i] + 0.7F * n[4][i] + 0.3F * n[5][i];
    const float spot =
        smooth_step(f.spot_level[i] - 2.0F * soft, f.spot_level[i] + 0.08F + 2.0F * soft, speckle);
    const float grain =
        0.35F * n[2][i] + 0.5F * n[3][i] + 0.6F * n[4][i] + 0.6F * n[5][i] + 0.5F * n[6][i];
    const float gain = std::max(0.15F, 1.0F + f.detail[i] * grain);
    const auto colour = [&](std::size_t c) {
      const float under = gain * (f.base[c][i] + growth * (f.growth[c][i] - f.base[c][i]));
      return std::min(0.95F, under + spot * (f.spot[c][i] - under));
    };
    rays.red[i] = colour(0);
    rays.green[i] = colour(1);
    rays.blue[i] = colour(2);
  }
}

std::uint64_t digest(const std::string& name) {
  Fnv1a64 fnv;
  fnv.add(name);
  return fnv.value() ^ (fnv.value() >> 29U);
}

}  // namespace

Texture texture_of(const std::string& name, bool is_ground) {
  std::string lower = name;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const auto contains = [&](std::initializer_list<std::string_view> words) {
    return std::any_of(words.begin(), words.end(), [&](std::string_view word) {
      return lower.find(word) != std::string::npos;
    });
  };
  if (contains({"seabed", "ground", "sand", "bottom"})) return Texture::kSand;
  if (contains({"basin", "pool", "wall", "floor", "quay"})) return Texture::kConcrete;
  if (is_ground) return Texture::kSand;
  return digest(name) % 2 == 0 ? Texture::kRust : Texture::kPaint;
}

float tone_of(const std::string& name) {
  return 0.75F + 0.5F * static_cast<float>((digest(name) >> 8U) & 0xffU) / 255.0F;
}

void paint(RayBatch& rays) {
  Octaves octaves;
  ColumnOf figures;
  float finest = RayBatch::kFar;
  for (int k = 0; k < rays.count; ++k) {
    finest = std::min(finest, rays.footprint[static_cast<std::size_t>(k)]);
  }
  for (std::size_t k = 0; k < kSpacing.size(); ++k) {
    if (kSpacing[k] > finest) {
      octave(rays, kSpacing[k], static_cast<std::uint32_t>(0x9e3779b9U * (k + 1)), octaves[k]);
    } else {
      octaves[k].fill(0.0F);
    }
  }
  gather(rays, figures);
  mix(octaves, figures, rays);
}

}  // namespace dive::vehicle
