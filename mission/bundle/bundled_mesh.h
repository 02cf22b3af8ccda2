#pragma once
// The triangles of a map's meshes in a bundle. Of a log the convex pieces are enough, because a
// replay repeats map fixes and scans; a dive compares its scans with the triangles.

#include <string>
#include <vector>

#include "planning/world/mesh_source.h"

namespace dive::mission {

struct BundledMesh {
  bool is_simulation = false;  ///< Of the world of simulated dives, not of the map.
  std::string uri;             ///< As written in the map.
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  planning::TriangleMesh mesh;  ///< Scaled, m.
};

/// Passes on the meshes of `from`, and keeps the triangles of each.
class MeshKeeper final : public planning::MeshSource {
 public:
  /// Both must outlive this object.
  MeshKeeper(planning::MeshSource& from, bool is_simulation, std::vector<BundledMesh>& kept)
      : from_(from), is_simulation_(is_simulation), kept_(kept) {}
  [[nodiscard]] tl::expected<planning::FoundMesh, planning::MeshProblem> find(
      const std::string& uri, const Eigen::Vector3d& scale) override;

 private:
  planning::MeshSource& from_;
  bool is_simulation_;
  std::vector<BundledMesh>& kept_;
};

/// Meshes of a bundle: convex pieces from the text of planning::MeshFiles::bundle(), with their
/// triangles.
class BundledMeshes final : public planning::MeshSource {
 public:
  /// `meshes` must outlive this object.
  BundledMeshes(std::string_view pieces, bool is_simulation, const std::vector<BundledMesh>& meshes)
      : pieces_(pieces), is_simulation_(is_simulation), meshes_(meshes) {}
  [[nodiscard]] tl::expected<planning::FoundMesh, planning::MeshProblem> find(
      const std::string& uri, const Eigen::Vector3d& scale) override;

 private:
  planning::MeshBundle pieces_;
  bool is_simulation_;
  const std::vector<BundledMesh>& meshes_;
};

}  // namespace dive::mission
