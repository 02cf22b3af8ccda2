// glTF 2.0: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html

#include <bit>
#include <cstdint>
#include <span>

#include <nlohmann/json.hpp>

#include "mission/export/export_format.h"
#include "mission/export/mesh_lines.h"
#include "mission/report/base64.h"

namespace dive::mission {
namespace {

static_assert(std::endian::native == std::endian::little);

using Json = nlohmann::ordered_json;

// Numbers of the specification.
constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr int kPoints = 0;
constexpr int kLineStrip = 3;
constexpr int kTriangles = 4;

// x east, y up, z south.
Eigen::Vector3f turned(const Eigen::Vector3f& p_W) { return {p_W.x(), p_W.z(), -p_W.y()}; }

class Scene {
 public:
  void add(const std::string& name, const std::vector<Eigen::Vector3f>& points_W,
           const std::vector<std::array<std::uint32_t, 3>>& triangles, int mode,
           const Colour& colour) {
    if (points_W.empty()) return;
    Json primitive = {{"attributes", {{"POSITION", positions(points_W)}}}};
    if (!triangles.empty()) primitive["indices"] = indices(triangles);
    primitive["mode"] = mode;
    primitive["material"] = material(colour);
    nodes_.push_back({{"name", name}, {"mesh", meshes_.size()}});
    meshes_.push_back({{"name", name}, {"primitives", Json::array({std::move(primitive)})}});
  }

  std::string write(const Exported& exported) {
    Json roots = Json::array();
    for (std::size_t i = 0; i < nodes_.size(); ++i) roots.push_back(i);
    Json json = {{"asset", {{"version", "2.0"}, {"generator", "dive"}}}, {"scene", 0}};
    json["scenes"] = Json::array({{{"name", exported.name}, {"nodes", std::move(roots)}}});
    if (!nodes_.empty()) {
      json["nodes"] = std::move(nodes_);
      json["meshes"] = std::move(meshes_);
      json["materials"] = std::move(materials_);
      json["accessors"] = std::move(accessors_);
      json["bufferViews"] = std::move(views_);
      json["buffers"] = Json::array({{{"byteLength", bytes_.size()},
                                      {"uri", "data:application/octet-stream;base64," +
                                                  base64(std::as_bytes(std::span(bytes_)))}}});
    }
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  }

 private:
  std::size_t view(std::size_t begin, int target) {
    views_.push_back({{"buffer", 0},
                      {"byteOffset", begin},
                      {"byteLength", bytes_.size() - begin},
                      {"target", target}});
    return views_.size() - 1;
  }

  std::size_t positions(const std::vector<Eigen::Vector3f>& points_W) {
    const std::size_t begin = bytes_.size();
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p_W : points_W) {
      const Eigen::Vector3f p = turned(p_W);
      box.extend(p);
      bytes_.append(reinterpret_cast<const char*>(p.data()), 3 * sizeof(float));
    }
    const Eigen::Vector3f low = box.min();
    const Eigen::Vector3f high = box.max();
    accessors_.push_back({{"bufferView", view(begin, kArrayBuffer)},
                          {"componentType", kFloat},
                          {"count", points_W.size()},
                          {"type", "VEC3"},
                          {"min", {low.x(), low.y(), low.z()}},
                          {"max", {high.x(), high.y(), high.z()}}});
    return accessors_.size() - 1;
  }

  std::size_t indices(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
    const std::size_t begin = bytes_.size();
    bytes_.append(reinterpret_cast<const char*>(triangles.data()),
                  triangles.size() * sizeof triangles.front());
    accessors_.push_back({{"bufferView", view(begin, kElementArrayBuffer)},
                          {"componentType", kUnsignedInt},
                          {"count", 3 * triangles.size()},
                          {"type", "SCALAR"}});
    return accessors_.size() - 1;
  }

  std::size_t material(const Colour& colour) {
    Json factor = Json::array();
    for (const std::uint8_t part : colour) factor.push_back(part / 255.0);
    factor.push_back(1.0);
    materials_.push_back({{"pbrMetallicRoughness",
                           {{"baseColorFactor", std::move(factor)},
                            {"metallicFactor", 0.0},
                            {"roughnessFactor", 1.0}}},
                          {"doubleSided", true}});
    return materials_.size() - 1;
  }

  std::string bytes_;
  Json nodes_ = Json::array();
  Json meshes_ = Json::array();
  Json materials_ = Json::array();
  Json accessors_ = Json::array();
  Json views_ = Json::array();
};

}  // namespace

std::string to_gltf(const Exported& exported) {
  Scene scene;
  if (!exported.map.triangles.empty()) {
    scene.add("map", exported.map.vertices, exported.map.triangles, kTriangles, kMapColour);
  }
  for (const ColouredLine& line : lines_of(exported)) {
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3d& p : line.points_W) points.emplace_back(p.cast<float>());
    scene.add(line.name, points, {}, kLineStrip, line.colour);
  }
  scene.add("cloud", exported.cloud, {}, kPoints, kCloudColour);
  return scene.write(exported);
}

}  // namespace dive::mission
