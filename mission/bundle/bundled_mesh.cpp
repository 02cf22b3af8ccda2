#include "mission/bundle/bundled_mesh.h"

#include <algorithm>

namespace dive::mission {
namespace {

const BundledMesh* find_mesh(const std::vector<BundledMesh>& meshes, bool is_simulation,
                             const std::string& uri, const Eigen::Vector3d& scale) {
  const auto found = std::ranges::find_if(meshes, [&](const BundledMesh& each) {
    return each.is_simulation == is_simulation && each.uri == uri && each.scale == scale;
  });
  return found == meshes.end() ? nullptr : &*found;
}

}  // namespace

tl::expected<planning::FoundMesh, planning::MeshProblem> MeshKeeper::find(
    const std::string& uri, const Eigen::Vector3d& scale) {
  tl::expected<planning::FoundMesh, planning::MeshProblem> found = from_.find(uri, scale);
  if (found && find_mesh(kept_, is_simulation_, uri, scale) == nullptr) {
    kept_.push_back({is_simulation_, uri, scale, found->file.mesh});
  }
  return found;
}

tl::expected<planning::FoundMesh, planning::MeshProblem> BundledMeshes::find(
    const std::string& uri, const Eigen::Vector3d& scale) {
  tl::expected<planning::FoundMesh, planning::MeshProblem> found = pieces_.find(uri, scale);
  const BundledMesh* kept = find_mesh(meshes_, is_simulation_, uri, scale);
  if (found && kept != nullptr) found->file.mesh = kept->mesh;
  return found;
}

}  // namespace dive::mission
