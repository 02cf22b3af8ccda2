#pragma once
// A verified bundle: one file with everything that a checked mission needs for a dive, and what the
// check found. Its records are those of a dive log (record/log_frame.h), numbered from 0, with
// timestamp 0:
//   DIVE_BUNDLE                          bundle_t
//   DIVE_HEADER                          header_t: mission, map, vehicle, version, seed
//   DIVE_BUNDLE_MESH                     bundle_mesh_t, one for each mesh of a map
//   DIVE_OUT_PLAN_QUERY, DIVE_IN_PLAN    plan_query_t and plan_reply_t, for each leg
//   DIVE_BUNDLE_SEAL                     seal.h: the hash of all bytes before it
// A bundle names no file that is opened. See doc/decisions/verified-bundle.md.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "mission/bundle/bundled_mesh.h"
#include "mission/record/log.h"
#include "planning/plan.h"
#include "vehicle/link/key.h"

namespace dive::mission {

/// A leg of the nominal route with the plan that the check accepted.
struct BundledLeg {
  std::string state;
  std::string goal;
  planning::PlanRequest request;
  planning::PlanResult plan;
};

struct Bundle {
  /// Mission with its fragments and tables in place, map, pieces of its meshes, vehicle, version of
  /// dive, and seed of the plans.
  LogHeader header;
  std::string simulation_name;  ///< Of the world of simulated dives; empty: the map is it.
  std::string simulation_xml;
  std::string simulation_meshes;  ///< Convex pieces of its meshes.
  std::vector<BundledMesh> meshes;
  std::vector<BundledLeg> legs;
  std::string verdict;  ///< Findings, budgets and dives of the check: JSON.
};

inline constexpr std::size_t kMaxBundleBytes = 512U << 20U;
inline constexpr std::size_t kMaxBundledMeshes = 10'000;
inline constexpr std::size_t kMaxBundledLegs = 100'000;

struct OpenedBundle {
  Bundle bundle;
  std::string hash;           ///< BLAKE2b-256 of the content, 64 hexadecimal digits.
  bool has_code = false;      ///< It carries a code.
  bool is_authentic = false;  ///< The code is that of the key given.
};

/// The bytes of the file, with a code if there is a key. The error is a sentence: a part is larger
/// than a bundle may hold.
[[nodiscard]] tl::expected<std::vector<std::uint8_t>, std::string> pack_bundle(
    const Bundle& bundle, const std::optional<link::Key>& key);

/// The reverse. With a key, only a bundle whose code was made with it is accepted. The error is a
/// sentence. Never throws, whatever the bytes; memory stays in proportion to them.
[[nodiscard]] tl::expected<OpenedBundle, std::string> parse_bundle(
    std::span<const std::uint8_t> bytes, const std::optional<link::Key>& key);

/// Reads a regular file of at most kMaxBundleBytes.
[[nodiscard]] tl::expected<OpenedBundle, std::string> read_bundle(
    const std::string& path, const std::optional<link::Key>& key);

/// True if a file begins like a bundle; the rest may be damaged.
[[nodiscard]] bool begins_like_bundle(std::string_view head);

}  // namespace dive::mission
