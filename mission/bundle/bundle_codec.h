#pragma once
// The records of a bundle that a log does not have: bundle_t and bundle_mesh_t. As
// record/log_codec.h.

#include <string>

#include "mission/bundle/bundle.h"
#include "mission/record/log_codec.h"

namespace dive::mission {

inline constexpr std::size_t kMaxMeshValues = 3 * 12'000'000;  ///< Coordinates, or corners.

/// The texts of the first record.
struct BundleTexts {
  std::string simulation_name;
  std::string simulation_xml;
  std::string simulation_meshes;
  std::string verdict;
};

[[nodiscard]] bool encode(const BundleTexts& texts, Packet& packet);
[[nodiscard]] bool encode(const BundledMesh& mesh, Packet& packet);
[[nodiscard]] bool decode(PacketView packet, BundleTexts& texts);
/// Also false if a coordinate is not finite, or a corner is no vertex.
[[nodiscard]] bool decode(PacketView packet, BundledMesh& mesh);

}  // namespace dive::mission
