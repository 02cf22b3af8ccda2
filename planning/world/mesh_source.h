#pragma once
// Where the <mesh> elements of a map get their pieces from: files when a dive is prepared, its log
// when it is replayed.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "planning/world/mesh_pieces.h"

namespace dive::planning {

struct FoundMesh {
  MeshPieces pieces;
  TriangleMesh mesh;    ///< Scaled; empty when only the pieces are known.
  std::string warning;  ///< For whoever wrote the map, when not empty.
};

class MeshSource {
 public:
  virtual ~MeshSource() = default;
  /// The mesh a map refers to by `uri`, `scale` times its size. An error is half a sentence, "the
  /// mesh ..." before it.
  [[nodiscard]] virtual tl::expected<FoundMesh, std::string> find(const std::string& uri,
                                                                  const Eigen::Vector3d& scale) = 0;
};

/// Where the pieces of a mesh file are kept, by the scale that they have been made at.
[[nodiscard]] std::string pieces_path(const std::string& mesh_path, const Eigen::Vector3d& scale);

/// Mesh files on the disk, and their pieces beside them: what was decomposed once is kept in
/// FILE.SCALE.pieces (SCALE by digest) and taken from there while the mesh stays the same.
class MeshFiles final : public MeshSource {
 public:
  enum class Keep { kBesideTheMesh, kNothing };

  /// `say` is told when something is going to take its time.
  explicit MeshFiles(std::string map_path, std::function<void(const std::string&)> say = {},
                     Keep keep = Keep::kBesideTheMesh);

  /// Looks, in this order: file:// and plain names relative to the map; model://NAME/REST as
  /// NAME/REST beside the map, beside its folder, and below GZ_SIM_RESOURCE_PATH and
  /// GAZEBO_MODEL_PATH; at last REST, and the bare name of the file, beside the map.
  /// A mesh that needs too many pieces is tried again with twice the tolerance, up to 0.4 m; the
  /// warning says so.
  [[nodiscard]] tl::expected<FoundMesh, std::string> find(const std::string& uri,
                                                          const Eigen::Vector3d& scale) override;

  /// Everything found so far, for the log.
  [[nodiscard]] const std::string& bundle() const { return bundle_; }

 private:
  std::string map_path_;
  std::function<void(const std::string&)> say_;
  Keep keep_;
  std::vector<MeshKey> found_;
  std::string bundle_;
};

/// What MeshFiles::bundle() gave.
class MeshBundle final : public MeshSource {
 public:
  explicit MeshBundle(std::string_view bundle);
  [[nodiscard]] tl::expected<FoundMesh, std::string> find(const std::string& uri,
                                                          const Eigen::Vector3d& scale) override;

 private:
  std::vector<MeshPieces> meshes_;
};

}  // namespace dive::planning
