// PLY and glTF of a small world, read back by the formats' own rules.

#include <cstring>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mission/export/export_format.h"
#include "mission/export/read_exported.h"

namespace dive::mission {
namespace {

// A box of 2 x 4 x 6 m at (10, 20, -30), a ball, and a path of two waypoints.
Exported small_world() {
  planning::World world;
  world.obstacles.push_back({"crate", planning::Box{{2.0, 4.0, 6.0}}, {{10.0, 20.0, -30.0}, {}}});
  world.obstacles.push_back({"ball", planning::Sphere{1.0}, {{0.0, 0.0, -5.0}, {}}});
  for (planning::Obstacle& obstacle : world.obstacles) {
    obstacle.X_WO.q = Eigen::Quaterniond::Identity();
  }
  Exported exported = exported_map("small", world);
  ExportedPath path;
  path.goal = "there";
  path.waypoints = {{{1.0, 2.0, -3.0}, Eigen::Quaterniond::Identity()},
                    {{4.0, 5.0, -6.0}, Eigen::Quaterniond::Identity()}};
  exported.paths.push_back(path);
  return exported;
}

// Six times the signed volume of the triangles.
double volume_of(const DrawnMesh& mesh) {
  double six_volumes = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto at = [&](std::uint32_t i) -> Eigen::Vector3d {
      return mesh.vertices.at(i).cast<double>();
    };
    six_volumes += at(a).dot(at(b).cross(at(c)));
  }
  return six_volumes / 6.0;
}

TEST(DrawnWorld, ShapesEncloseTheirVolume) {
  planning::World world;
  const auto volume = [&](planning::Shape shape) {
    world.obstacles = {{"o", std::move(shape), {}}};
    return volume_of(drawn_world(world, 1000));
  };
  constexpr double kPi = 3.14159265358979;
  EXPECT_NEAR(volume(planning::Box{{1.0, 2.0, 3.0}}), 6.0, 1e-5);
  // Inscribed polygons and polyhedra: less than the round shape, by less than a tenth.
  const auto is_nearly = [](double drawn, double exact) {
    return drawn < exact && drawn > 0.9 * exact;
  };
  EXPECT_TRUE(is_nearly(volume(planning::Cylinder{1.0, 3.0}), 3.0 * kPi));
  EXPECT_TRUE(is_nearly(volume(planning::Sphere{1.0}), 4.0 / 3.0 * kPi));
  EXPECT_TRUE(is_nearly(volume(planning::Ellipsoid{{1.0, 2.0, 3.0}}), 8.0 * kPi));
  EXPECT_TRUE(is_nearly(volume(planning::Capsule{1.0, 3.0}), (4.0 / 3.0 + 3.0) * kPi));
}

TEST(Ply, HasTheMapAsTrianglesAndThePathAsPoints) {
  const Exported exported = small_world();
  const std::string text = to_ply(exported);
  const std::size_t vertices = exported.map.vertices.size() + 2;
  EXPECT_NE(text.find("element vertex " + std::to_string(vertices) + "\n"), std::string::npos);
  EXPECT_NE(text.find("element face " + std::to_string(exported.map.triangles.size()) + "\n"),
            std::string::npos);
  const std::size_t begin = text.find("end_header\n") + 11;
  ASSERT_EQ(text.size() - begin, vertices * 15 + exported.map.triangles.size() * 13);
  float last[3];
  std::memcpy(last, text.data() + begin + (vertices - 1) * 15, sizeof last);
  EXPECT_EQ(last[0], 4.0F);
  EXPECT_EQ(last[1], 5.0F);
  EXPECT_EQ(last[2], -6.0F);
  const std::size_t face = begin + vertices * 15;
  EXPECT_EQ(text[face], 3);
  std::uint32_t corner = 0;
  std::memcpy(&corner, text.data() + face + 1, sizeof corner);
  EXPECT_EQ(corner, exported.map.triangles[0][0]);
}

std::string decoded(const std::string& base64) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : base64) {
    if (c == '=') break;
    bits = (bits << 6U) | static_cast<unsigned>(digits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>((bits >> static_cast<unsigned>(count)) & 0xFFU);
  }
  return bytes;
}

TEST(Gltf, IsYUpWithOneEmbeddedBuffer) {
  const Exported exported = small_world();
  const auto json = nlohmann::json::parse(to_gltf(exported));
  EXPECT_EQ(json.at("asset").at("version"), "2.0");
  const std::string uri = json.at("buffers").at(0).at("uri");
  const std::string head = "data:application/octet-stream;base64,";
  ASSERT_EQ(uri.substr(0, head.size()), head);
  const std::string bytes = decoded(uri.substr(head.size()));
  ASSERT_EQ(bytes.size(), json.at("buffers").at(0).at("byteLength").get<std::size_t>());
  ASSERT_EQ(json.at("meshes").size(), 2U);
  const auto& line = json.at("meshes").at(1).at("primitives").at(0);
  EXPECT_EQ(line.at("mode"), 3);
  const auto& accessor =
      json.at("accessors").at(line.at("attributes").at("POSITION").get<std::size_t>());
  ASSERT_EQ(accessor.at("count"), 2);
  const auto& view = json.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
  float p[6];
  ASSERT_EQ(view.at("byteLength").get<std::size_t>(), sizeof p);
  std::memcpy(p, bytes.data() + view.at("byteOffset").get<std::size_t>(), sizeof p);
  // East stays x, up is y, north is -z.
  EXPECT_EQ(std::vector<float>(p, p + 3), (std::vector<float>{1.0F, -3.0F, -2.0F}));
  EXPECT_EQ(accessor.at("min"), (std::vector<double>{1.0, -6.0, -5.0}));
  const auto& triangles = json.at("meshes").at(0).at("primitives").at(0);
  EXPECT_EQ(json.at("accessors").at(triangles.at("indices").get<std::size_t>()).at("count"),
            3 * exported.map.triangles.size());
}

}  // namespace
}  // namespace dive::mission
