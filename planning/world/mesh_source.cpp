#include "planning/world/mesh_source.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "common/fnv.h"
#include "common/input_file.h"
#include "common/path_beneath.h"
#include "common/source_text.h"
#include "planning/world/mesh.h"
#include "planning/world/mesh_extent.h"

namespace dive::planning {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxMeshBytes = 512U << 20U;
constexpr std::size_t kMaxPiecesBytes = 256U << 20U;
constexpr double kCoarsest = 0.4;  // m

bool take_prefix(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return true;
}

MeshProblem problem(std::string message) { return {.message = std::move(message)}; }

/// Where the file of a mesh may be, and the canonical folder that it must not leave.
struct FilePlace {
  fs::path path;
  fs::path root;
};

void add_search_path(const char* variable, const std::string& rest,
                     std::vector<FilePlace>& places) {
  const char* value = std::getenv(variable);
  std::istringstream folders(value != nullptr ? value : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (folder.empty()) continue;
    places.push_back({fs::path(folder) / rest, canonical_folder_of(folder + "/")});
  }
}

std::vector<FilePlace> places_of(std::string_view uri, const fs::path& folder,
                                 const fs::path& root) {
  if (take_prefix(uri, "model://")) {
    const std::string rest(uri);
    const std::string below = rest.substr(std::min(rest.find('/') + 1, rest.size()));
    std::vector<FilePlace> places{{folder / rest, root}, {folder / ".." / rest, root}};
    add_search_path("GZ_SIM_RESOURCE_PATH", rest, places);
    add_search_path("GAZEBO_MODEL_PATH", rest, places);
    places.push_back({folder / below, root});
    places.push_back({folder / fs::path(below).filename(), root});
    return places;
  }
  take_prefix(uri, "file://");
  return {{folder / uri, root}};
}

MeshProblem outside(const fs::path& path) {
  return {"MAP-OUTSIDE", fmt::format("lies outside of the map's folder: {}", path.string()),
          "copy it beneath the map's folder, or give --allow-outside if you trust the map"};
}

MeshProblem not_found(const std::vector<FilePlace>& places) {
  std::vector<std::string> searched;
  for (const FilePlace& place : places) {
    searched.push_back(place.path.lexically_normal().string());
    std::error_code ignored;
    const fs::file_status status = fs::status(place.path, ignored);
    if (!fs::exists(status) || fs::is_directory(status)) continue;
    return problem(fmt::format("is not a regular file: {}", searched.back()));
  }
  return problem(fmt::format("was not found as {}", fmt::join(searched, ", nor as ")));
}

tl::expected<fs::path, MeshProblem> locate(const std::string& uri, const std::string& map_path,
                                           Resources resources) {
  if (uri.find("://") != std::string::npos && !uri.starts_with("model://") &&
      !uri.starts_with("file://")) {
    return tl::unexpected(problem("is not on this machine: put its file beside the map"));
  }
  const std::vector<FilePlace> places =
      places_of(uri, fs::path(map_path).parent_path(), canonical_folder_of(map_path));
  std::optional<fs::path> refused;
  for (const FilePlace& place : places) {
    std::error_code ignored;
    if (!fs::is_regular_file(place.path, ignored)) continue;
    fs::path path = place.path.lexically_normal();
    if (resources == Resources::kAnywhere || is_beneath(path, place.root)) return path;
    if (!refused) refused = std::move(path);
  }
  return tl::unexpected(refused ? outside(*refused) : not_found(places));
}

bool same(const MeshKey& a, const MeshKey& b) {
  return a.uri == b.uri && a.scale == b.scale && a.digest == b.digest;
}

// Any error in the file means that the pieces are made again.
std::optional<std::string> kept_pieces(const fs::path& path, const MeshKey& key) {
  auto text = read_source_text(path.string(), kMaxPiecesBytes);
  if (!text) return std::nullopt;
  std::string_view rest = text->content();
  const std::optional<MeshPieces> pieces = take_mesh_pieces(rest);
  if (!pieces || !rest.empty() || !same(pieces->key, key)) return std::nullopt;
  return text->content();
}

// Written under another name first, so that no process reads a partial file.
void keep_pieces(const fs::path& path, const std::string& text) {
  fs::path draft = path;
  draft += ".new";
  std::error_code failed;
  {
    std::ofstream file(draft, std::ios::binary);
    file << text;
    if (!file.flush()) failed = std::make_error_code(std::errc::io_error);
  }
  if (!failed) fs::rename(draft, path, failed);
  if (failed) fs::remove(draft, failed);
}

// FNV-1a of a regular file of at most kMaxMeshBytes, which is never loaded as a whole.
tl::expected<std::uint64_t, std::string> digest_of(const fs::path& path) {
  const auto opened = open_input_stream(path.string());
  if (!opened) {
    return tl::unexpected(fmt::format("cannot be read: {}: {}", path.string(), opened.error()));
  }
  std::istream& stream = **opened;
  Fnv1a64 digest;
  std::string chunk(1U << 16U, '\0');
  std::size_t size = 0;
  while (stream) {
    stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    const auto got = static_cast<std::size_t>(stream.gcount());
    digest.add(std::string_view(chunk).substr(0, got));
    size += got;
    if (size > kMaxMeshBytes) {
      return tl::unexpected(fmt::format("cannot be read: {} is larger than {} MiB", path.string(),
                                        kMaxMeshBytes >> 20U));
    }
  }
  return digest.value();
}

tl::expected<MeshPieces, std::string> make_pieces(const TriangleMesh& mesh, const MeshKey& key) {
  DecompositionOptions options;
  for (;;) {
    auto pieces = decompose(mesh, options);
    if (pieces && pieces->empty()) return tl::unexpected(std::string("holds no area at all"));
    if (pieces) return MeshPieces{key, options.tolerance, std::move(*pieces)};
    if (2.0 * options.tolerance > kCoarsest) {
      return tl::unexpected(fmt::format("cannot be used: {}", pieces.error()));
    }
    options.tolerance *= 2.0;
  }
}

}  // namespace

std::string pieces_path(const std::string& mesh_path, const Eigen::Vector3d& scale) {
  Fnv1a64 digest;
  digest.add(fmt::format("{} {} {}", scale.x(), scale.y(), scale.z()));
  return fmt::format("{}.{:08x}.pieces", mesh_path, digest.value() >> 32U);
}

MeshFiles::MeshFiles(std::string map_path, Resources resources,
                     std::function<void(const std::string&)> say, Keep keep)
    : map_path_(std::move(map_path)), resources_(resources), say_(std::move(say)), keep_(keep) {}

tl::expected<FoundMesh, MeshProblem> MeshFiles::find(const std::string& uri,
                                                     const Eigen::Vector3d& scale) {
  const auto path = locate(uri, map_path_, resources_);
  if (!path) return tl::unexpected(path.error());
  const auto digest = digest_of(*path);
  if (!digest) return tl::unexpected(problem(digest.error()));
  auto file = read_mesh(path->string());
  if (!file) return tl::unexpected(problem(fmt::format("cannot be used: {}", file.error())));
  for (Eigen::Vector3d& v : file->mesh.vertices) v = v.cwiseProduct(scale);
  if (auto excess = excess_of(file->mesh, path->string(), scale)) {
    return tl::unexpected(MeshProblem{"MAP-EXTENT", excess->message, excess->hint});
  }

  const MeshKey key{uri, scale, *digest};
  const fs::path kept = pieces_path(path->string(), scale);
  std::optional<std::string> text = kept_pieces(kept, key);
  if (!text) {
    if (say_) {
      say_(fmt::format("making convex pieces of {} ({} triangles), this once", path->string(),
                       file->mesh.triangles.size()));
    }
    const auto made = make_pieces(file->mesh, key);
    if (!made) return tl::unexpected(problem(made.error()));
    text = to_text(*made);
    if (keep_ == Keep::kBesideTheMesh) keep_pieces(kept, *text);
  }
  // Always from the text, so that the pieces used in planning equal those of the log, to the last
  // bit.
  std::string_view rest = *text;
  FoundMesh found{*take_mesh_pieces(rest), std::move(*file), path->string(), ""};
  if (found.pieces.tolerance > DecompositionOptions{}.tolerance) {
    found.warning = fmt::format(
        "is approximated by pieces that reach up to {:.1f} m beyond it: at {:.2f} m it would take "
        "too many of them",
        found.pieces.tolerance, DecompositionOptions{}.tolerance);
  }
  if (std::ranges::none_of(found_, [&](const MeshKey& known) { return same(known, key); })) {
    found_.push_back(key);
    bundle_ += *text;
  }
  return found;
}

MeshBundle::MeshBundle(std::string_view bundle) {
  while (auto mesh = take_mesh_pieces(bundle)) meshes_.push_back(std::move(*mesh));
}

tl::expected<FoundMesh, MeshProblem> MeshBundle::find(const std::string& uri,
                                                      const Eigen::Vector3d& scale) {
  for (const MeshPieces& mesh : meshes_) {
    if (mesh.key.uri == uri && mesh.key.scale == scale) return FoundMesh{mesh, {}, "", ""};
  }
  return tl::unexpected(problem("is not in the log"));
}

}  // namespace dive::planning
