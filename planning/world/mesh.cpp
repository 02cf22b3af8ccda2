#include "planning/world/mesh.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <unordered_map>

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include "common/fnv.h"
#include "common/input_file.h"
#include "planning/world/assimp_files.h"
#include "planning/world/grid.h"

namespace dive::planning {
namespace {

using Corner = std::array<float, 3>;

struct HashOfCorner {
  std::size_t operator()(const Corner& corner) const {
    Fnv1a64 digest;
    digest.add(std::string_view(reinterpret_cast<const char*>(corner.data()), sizeof corner));
    return digest.value();
  }
};

// Three corners for each triangle. Lines and points are not obstacles.
std::vector<Corner> corners_of(const aiScene& scene) {
  std::vector<Corner> corners;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    corners.reserve(corners.size() + 3UL * part.mNumFaces);
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      for (unsigned k = 0; k < 3; ++k) {
        const aiVector3D& v = part.mVertices[face.mIndices[k]];
        // Adding zero removes negative zeros.
        corners.push_back({v.x + 0.F, v.y + 0.F, v.z + 0.F});
      }
    }
  }
  return corners;
}

// Vertices in the order of their first use.
TriangleMesh welded(const std::vector<Corner>& corners) {
  TriangleMesh mesh;
  mesh.triangles.resize(corners.size() / 3);
  std::unordered_map<Corner, std::uint32_t, HashOfCorner> known;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto [at, is_new] = known.try_emplace(corners[i], next);
    if (is_new) mesh.vertices.emplace_back(corners[i][0], corners[i][1], corners[i][2]);
    mesh.triangles[i / 3][i % 3] = at->second;
  }
  return mesh;
}

// Reads the unit and up axis from the first <asset> of a COLLADA file; Assimp applies the unit and
// exposes neither.
void read_collada_asset(const std::string& path, MeshFile& file) {
  constexpr std::size_t kHead = 1U << 16U;  // bytes
  std::string head(kHead, '\0');
  const auto stream = open_input_stream(path);
  if (!stream) return;
  (*stream)->read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>((*stream)->gcount()));
  if (head.find("<COLLADA") == std::string::npos) return;
  head.resize(std::min(head.find("</asset>"), head.size()));
  if (const std::size_t unit = head.find("<unit"); unit != std::string::npos) {
    const std::string element = head.substr(unit, head.find('>', unit) - unit);
    const std::size_t meter = element.find(" meter=");
    const double value =
        meter == std::string::npos ? 1.0 : std::strtod(element.c_str() + meter + 8, nullptr);
    if (value > 0.0 && std::isfinite(value)) file.unit_m = value;
  }
  const std::string_view tag = "<up_axis>";
  if (const std::size_t up = head.find(tag); up != std::string::npos) {
    const std::size_t axis = head.find_first_not_of(" \t\r\n", up + tag.size());
    const bool is_axis = axis != std::string::npos && head[axis] >= 'X' && head[axis] <= 'Z';
    if (is_axis && head.compare(axis + 1, 3, "_UP") == 0) file.up_axis = head[axis];
  }
}

}  // namespace

tl::expected<MeshFile, std::string> read_mesh(const std::string& path) {
  if (is_grid(path)) {
    return read_grid(path).map([](TriangleMesh mesh) {
      return MeshFile{std::move(mesh), {}, '\0'};
    });
  }
  Assimp::Importer importer;
  importer.SetIOHandler(new AssimpFiles(path));  // owned by the importer
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyInteger(
      AI_CONFIG_PP_RVC_FLAGS,
      aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
          aiComponent_TEXCOORDS | aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
          aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS | aiComponent_MATERIALS);
  const aiScene* scene = importer.ReadFile(
      path, aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_PreTransformVertices);
  if (scene == nullptr) return tl::unexpected(std::string(importer.GetErrorString()));
  const std::vector<Corner> corners = corners_of(*scene);
  importer.FreeScene();
  if (corners.empty()) return tl::unexpected(std::string("it holds no triangles"));
  if (corners.size() > 3 * kMaxTriangles) {
    return tl::unexpected(fmt::format("it holds {} triangles, and {} can be handled",
                                      corners.size() / 3, kMaxTriangles));
  }
  MeshFile file;
  file.mesh = welded(corners);
  for (const Eigen::Vector3d& v : file.mesh.vertices) {
    if (!v.allFinite()) {
      return tl::unexpected(std::string("it holds a coordinate that is not a finite number"));
    }
  }
  read_collada_asset(path, file);
  return file;
}

}  // namespace dive::planning
