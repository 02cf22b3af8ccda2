#pragma once
// The source of the pieces for a map's <mesh> elements: files when a dive is prepared, its log when
// it is replayed.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "planning/world/mesh.h"
#include "planning/world/mesh_pieces.h"

namespace dive::planning {

struct FoundMesh {
  MeshPieces pieces;
  MeshFile file;        ///< The mesh, scaled; without triangles if only the pieces are known.
  std::string path;     ///< Path of the file; empty if only the pieces are known.
  std::string warning;  ///< Warning for the author of the map, or empty.
};

/// The reason why there is no mesh.
struct MeshProblem {
  const char* code = "MAP-MESH";
  std::string message;  ///< End of a sentence that begins "the mesh ...".
  std::string hint = {};
};

class MeshSource {
 public:
  virtual ~MeshSource() = default;
  /// The mesh that a map refers to by `uri`, scaled by `scale`.
  [[nodiscard]] virtual tl::expected<FoundMesh, MeshProblem> find(const std::string& uri,
                                                                  const Eigen::Vector3d& scale) = 0;
};

/// Where the files that a map refers to may be.
enum class Resources { kInFolder, kAnywhere };

/// Path of the file that stores the pieces of a mesh file at one scale.
[[nodiscard]] std::string pieces_path(const std::string& mesh_path, const Eigen::Vector3d& scale);

/// Mesh files on disk, with their pieces in files beside them: a decomposition is stored in
/// FILE.SCALE.pieces (SCALE by digest) and reused while the mesh is unchanged.
class MeshFiles final : public MeshSource {
 public:
  enum class Keep { kBesideTheMesh, kNothing };

  /// `say` is called before a slow step.
  explicit MeshFiles(std::string map_path, Resources resources = Resources::kInFolder,
                     std::function<void(const std::string&)> say = {},
                     Keep keep = Keep::kBesideTheMesh);

  /// Searches, in this order: file:// and plain names relative to the map; model://NAME/REST as
  /// NAME/REST beside the map, beside its folder, and below GZ_SIM_RESOURCE_PATH and
  /// GAZEBO_MODEL_PATH; finally REST, and the bare file name, beside the map. A mesh that needs too
  /// many pieces is decomposed again with twice the tolerance, up to 0.4 m; the warning reports it.
  /// Unless resources may be anywhere, a file outside of the map's folder, with symbolic links
  /// resolved, is a problem with code MAP-OUTSIDE; the folders of the two variables, which are the
  /// operator's own choice, are permitted as well.
  /// Vertices beyond kMaxMeshExtent are a problem with code MAP-EXTENT.
  [[nodiscard]] tl::expected<FoundMesh, MeshProblem> find(const std::string& uri,
                                                          const Eigen::Vector3d& scale) override;

  /// All meshes found so far, for the log.
  [[nodiscard]] const std::string& bundle() const { return bundle_; }

 private:
  std::string map_path_;
  Resources resources_;
  std::function<void(const std::string&)> say_;
  Keep keep_;
  std::vector<MeshKey> found_;
  std::string bundle_;
};

/// Meshes from the text of MeshFiles::bundle().
class MeshBundle final : public MeshSource {
 public:
  explicit MeshBundle(std::string_view bundle);
  [[nodiscard]] tl::expected<FoundMesh, MeshProblem> find(const std::string& uri,
                                                          const Eigen::Vector3d& scale) override;

 private:
  std::vector<MeshPieces> meshes_;
};

}  // namespace dive::planning
