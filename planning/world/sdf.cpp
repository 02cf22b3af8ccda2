#include "planning/world/sdf.h"

#include <array>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "common/xml.h"
#include "planning/world/grid.h"
#include "planning/world/mesh_facts.h"
#include "planning/world/mesh_remarks.h"
#include "planning/world/sdf_geometry.h"

namespace dive::planning {
namespace {

// Gazebo's sun is a light; any other include may be a wall.
constexpr std::array<std::string_view, 2> kLights{"model://sun", "model://sun_lamp"};

bool is_light(const XmlElement& include) {
  const XmlElement* uri = include.child("uri");
  return uri != nullptr && (uri->text == kLights[0] || uri->text == kLights[1]);
}

// Walks world / model / link / collision with the accumulated pose, and collects what is solid.
class Reader {
 public:
  Reader(const SourceText& source, Diagnostics& diagnostics, MeshSource& meshes)
      : values_(source, diagnostics), meshes_(meshes) {}

  void root(const XmlElement& sdf) {
    if (sdf.name != "sdf") {
      values_.error("MAP-ROOT", sdf.span,
                    fmt::format("a map starts with <sdf>, not <{}>", sdf.name));
      return;
    }
    version(sdf);
    bool seen_world = false;
    for (const XmlElement& element : sdf.children) {
      if (element.name == "world" && seen_world) {
        values_.error("MAP-WORLDS", element.span, "a map holds one <world>, and this is another");
      } else if (element.name == "world") {
        seen_world = true;
        members(element, {}, "");
      }
    }
    // Files of single objects have their models directly below <sdf>. The members of a <world> are
    // not read twice, because members() ignores <world>.
    members(sdf, {}, "");
  }

  [[nodiscard]] World take() {
    if (first_mesh_) {
      for (const MeshRemark& each : remarks_on_all(meshes_W_)) warn(*first_mesh_, each);
    }
    return std::move(world_);
  }

 private:
  void version(const XmlElement& sdf) const {
    const XmlAttribute* attribute = sdf.attribute("version");
    static constexpr std::array<std::string_view, 8> kKnown{"1.4", "1.5", "1.6",  "1.7",
                                                            "1.8", "1.9", "1.10", "1.11"};
    for (const std::string_view known : kKnown) {
      if (attribute != nullptr && attribute->value == known) return;
    }
    values_.error("MAP-VERSION", attribute != nullptr ? attribute->value_span : sdf.span,
                  attribute != nullptr
                      ? fmt::format("SDF version \"{}\" is not known", attribute->value)
                      : std::string("<sdf> needs a version"),
                  "versions 1.4 to 1.11 are read");
  }

  // Reads the elements of a world or a model that are, or may be, solid. Lights, physics, plugins
  // and the like are ignored.
  void members(const XmlElement& parent, const Pose& X_WP, const std::string& path) {
    for (const XmlElement& element : parent.children) {
      if (element.name == "model") {
        model(element, X_WP, path);
      } else if (element.name == "link") {
        link(element, X_WP, path);
      } else if (element.name == "include" && !is_light(element)) {
        values_.error("MAP-UNSUPPORTED", element.span, "an <include> cannot be followed here",
                      "copy the included model's collisions into this file");
      } else if (element.name == "population" || element.name == "actor") {
        values_.error("MAP-UNSUPPORTED", element.span,
                      fmt::format("<{}> is not something a map can hold", element.name));
      } else if (element.name == "state" && element.child("model") != nullptr) {
        values_.error("MAP-UNSUPPORTED", element.span,
                      "a saved <state> may have moved the models of this world",
                      "write its poses into the models and delete it");
      }
    }
  }

  void model(const XmlElement& element, const Pose& X_WP, const std::string& path) {
    if (const XmlAttribute* frame = element.attribute("placement_frame")) {
      values_.error("MAP-FRAME", frame->name_span, "placement_frame is not supported");
    }
    const XmlElement* fixed = element.child("static");
    if (path.empty() && (fixed == nullptr || (fixed->text != "true" && fixed->text != "1"))) {
      values_.warning("MAP-MOVABLE", element.span,
                      "this model is not static: it is taken to stay where it is drawn");
    }
    members(element, X_WP * values_.pose_of(element), path + name_of(element) + "/");
  }

  void link(const XmlElement& element, const Pose& X_WM, const std::string& path) {
    const Pose X_WL = X_WM * values_.pose_of(element);
    const std::string name = path + name_of(element) + "/";
    for (const XmlElement& child : element.children) {
      if (child.name == "collision") collision(child, X_WL, name);
    }
  }

  void collision(const XmlElement& element, const Pose& X_WL, const std::string& path) {
    const std::string name = path + name_of(element);
    const Pose X_WO = X_WL * values_.pose_of(element);
    const XmlElement* geometry = element.child("geometry");
    if (geometry == nullptr) {
      values_.error("MAP-MISSING", element.span, "<collision> needs a <geometry>");
      return;
    }
    if (geometry->children.size() != 1) {
      values_.error(
          "MAP-GEOMETRY", geometry->span,
          fmt::format("<geometry> must hold exactly one shape, not {}", geometry->children.size()));
      return;
    }
    const XmlElement& drawn = geometry->children.front();
    if (drawn.name == "mesh") {
      mesh(drawn, name, X_WO);
    } else if (auto shape = values_.shape_of(drawn)) {
      world_.obstacles.push_back({name, std::move(*shape), X_WO});
    }
  }

  void mesh(const XmlElement& element, const std::string& name, const Pose& X_WO) {
    const std::optional<SdfMesh> wanted = values_.mesh_of(element);
    if (!wanted) return;
    auto found = meshes_.find(wanted->uri, wanted->scale);
    if (!found) {
      const MeshProblem& problem = found.error();
      values_.error(problem.code, wanted->uri_span, "the mesh " + problem.message, problem.hint);
      return;
    }
    if (!found->warning.empty()) {
      values_.warning("MAP-COARSE", wanted->uri_span, "the mesh " + found->warning,
                      "a mesh with fewer triangles, or less of it, will do better");
    }
    int surface = -1;
    if (!found->file.mesh.triangles.empty()) {
      for (Eigen::Vector3d& v : found->file.mesh.vertices) v = X_WO * v;
      remark(*wanted, *found, X_WO);
      surface = static_cast<int>(world_.surfaces.size());
      world_.surfaces.push_back({name, std::move(found->file.mesh), found->path});
    }
    for (Polytope& piece : found->pieces.pieces) {
      world_.obstacles.push_back({name, Shape(), X_WO, surface});
      // Relative to their own centre: the box around a shape is assumed to be centred in its frame.
      const Eigen::Vector3d middle = middle_of(piece.vertices);
      for (Eigen::Vector3d& v : piece.vertices) v -= middle;
      world_.obstacles.back().X_WO.p = X_WO * middle;
      world_.obstacles.back().shape = std::move(piece);
    }
  }

  // Each warning once per file: a map may use one mesh in many places.
  void remark(const SdfMesh& wanted, const FoundMesh& found, const Pose& X_WO) {
    const PlacedMesh placed{found.file, wanted.scale, X_WO.q.toRotationMatrix(),
                            facts_of(found.file.mesh)};
    for (const MeshRemark& each : remarks_on(placed)) warn(wanted, each);
    meshes_W_.extend(placed.facts.bounds);
    if (!first_mesh_) first_mesh_ = wanted;
  }

  void warn(const SdfMesh& mesh, const MeshRemark& remark) {
    if (!remarked_.emplace(remark.code, mesh.uri).second) return;
    values_.warning(remark.code, mesh.uri_span, "the mesh " + remark.message, remark.hint);
  }

  static Eigen::Vector3d middle_of(const std::vector<Eigen::Vector3d>& points) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& v : points) box.extend(v);
    return box.center();
  }

  [[nodiscard]] std::string name_of(const XmlElement& element) const {
    const XmlAttribute* attribute = element.attribute("name");
    if (attribute != nullptr && !attribute->value.empty()) return attribute->value;
    values_.error("MAP-MISSING", element.span, fmt::format("<{}> needs a name", element.name));
    return "?";
  }

  SdfValues values_;
  MeshSource& meshes_;
  World world_;
  Eigen::AlignedBox3d meshes_W_;
  std::optional<SdfMesh> first_mesh_;
  std::set<std::pair<std::string, std::string>> remarked_;  // Code and URI.
};

}  // namespace

std::optional<World> parse_sdf(SourceText source, Diagnostics& diagnostics, MeshSource& meshes) {
  const std::optional<XmlDocument> document = parse_xml(std::move(source), kSdfLimits, diagnostics);
  if (!document) return std::nullopt;
  const std::size_t errors_before = diagnostics.error_count();
  Reader reader(document->source, diagnostics, meshes);
  reader.root(document->root);
  if (diagnostics.error_count() != errors_before) return std::nullopt;
  return reader.take();
}

tl::expected<SourceText, std::string> read_map_text(const std::string& path) {
  if (is_grid(path)) return grid_as_map(path);
  return read_source_text(path, kSdfLimits.max_bytes);
}

std::optional<World> load_sdf(const std::string& path, Diagnostics& diagnostics,
                              Resources resources) {
  tl::expected<SourceText, std::string> text = read_map_text(path);
  if (!text) {
    diagnostics.unreadable(path, text.error());
    return std::nullopt;
  }
  MeshFiles meshes(path, resources);
  return parse_sdf(std::move(*text), diagnostics, meshes);
}

}  // namespace dive::planning
