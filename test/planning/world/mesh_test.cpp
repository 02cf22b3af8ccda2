// Meshes of maps: solids are covered, openings stay open, and damaged files are handled.

#include "planning/world/mesh.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <sys/stat.h>

#include "common/input_file.h"
#include "planning/world/mesh_source.h"
#include "planning/world/primitives.h"
#include "planning/world/scene.h"
#include "planning/world/sdf.h"
#include "test/common/allocations.h"
#include "test/common/arbitrary.h"
#include "test/planning/reference.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::arbitrary_double;
using testing::arbitrary_vector;
using testing::draw;

using Triangle = std::array<Vector3d, 3>;

void add(TriangleMesh& mesh, const Triangle& t) {
  const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), t.begin(), t.end());
  mesh.triangles.push_back({n, n + 1, n + 2});
}

void add_quad(TriangleMesh& mesh, const Vector3d& corner, const Vector3d& u, const Vector3d& v) {
  add(mesh, {corner, corner + u, corner + u + v});
  add(mesh, {corner, corner + u + v, corner + v});
}

// A wall of 6 x 4 m in the plane y = 0, with a window of 2 x 1 m.
TriangleMesh wall_with_window() {
  TriangleMesh mesh;
  add_quad(mesh, {-3, 0, -2}, {6, 0, 0}, {0, 0, 1.5});
  add_quad(mesh, {-3, 0, 0.5}, {6, 0, 0}, {0, 0, 1.5});
  add_quad(mesh, {-3, 0, -0.5}, {2, 0, 0}, {0, 0, 1});
  add_quad(mesh, {1, 0, -0.5}, {2, 0, 0}, {0, 0, 1});
  return mesh;
}

// A sphere of radius r as rings of triangles.
TriangleMesh ball(double r, int rings) {
  const auto at = [&](int i, int j) -> Vector3d {
    const double a = M_PI * i / rings;
    const double b = M_PI * j / rings;
    return r * Vector3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
  };
  TriangleMesh mesh;
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < 2 * rings; ++j) {
      add(mesh, {at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      add(mesh, {at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

std::vector<Polytope> pieces_of(const TriangleMesh& mesh, double tolerance = 0.05) {
  DecompositionOptions options;
  options.tolerance = tolerance;
  auto pieces = decompose(mesh, options);
  EXPECT_TRUE(pieces) << (pieces ? "" : pieces.error());
  return pieces.value_or(std::vector<Polytope>{});
}

// True if p is within the radius of the hull of the vertices, tested with half-spaces: p is farther
// than that exactly if the test fails in some direction.
bool holds(const Polytope& piece, const Vector3d& p, const std::vector<Vector3d>& directions) {
  return std::ranges::none_of(directions, [&](const Vector3d& n) {
    double most = -1e300;
    for (const Vector3d& v : piece.vertices) most = std::max(most, n.dot(v));
    return n.dot(p) > most + piece.radius + 1e-9;
  });
}

// The distance from p to a triangle: to its plane where p projects into it, else to its edges.
double exact_distance(const Triangle& t, const Vector3d& p) {
  const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  bool is_over = true;
  double least = 1e300;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d& a = t[i];
    const Vector3d edge = t[(i + 1) % 3] - a;
    is_over = is_over && n.dot(edge.cross(p - a)) >= 0.0;
    const double along = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - a - along * edge).norm());
  }
  return is_over ? std::abs(n.dot(p - t[0])) : least;
}

// The distance from p to a triangle, by sampling it on a fine lattice: never too small.
double sampled_distance(const Triangle& t, const Vector3d& p, int n) {
  double least = 1e300;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; i + j <= n; ++j) {
      const double a = static_cast<double>(i) / n;
      const double b = static_cast<double>(j) / n;
      least = std::min(least, (t[0] + a * (t[1] - t[0]) + b * (t[2] - t[0]) - p).norm());
    }
  }
  return least;
}

TriangleMesh arbitrary_soup() {
  TriangleMesh mesh;
  const int triangles = *rc::gen::inRange(1, 25);
  for (int i = 0; i < triangles; ++i) {
    const Vector3d at = draw(arbitrary_vector(1.0));
    const double size = draw(arbitrary_double(0.02, 1.0));
    add(mesh,
        {at, at + size * draw(arbitrary_vector(1.0)), at + size * draw(arbitrary_vector(1.0))});
  }
  return mesh;
}

TEST(Decompose, HoldsEveryPointOfEveryTriangle) {
  const auto compass = testing::directions(400);
  EXPECT_TRUE(rc::check([&] {
    const TriangleMesh mesh = arbitrary_soup();
    const auto pieces = pieces_of(mesh, draw(arbitrary_double(0.02, 0.5)));
    for (const auto& [a, b, c] : mesh.triangles) {
      double u = draw(arbitrary_double(0.0, 1.0));
      double v = draw(arbitrary_double(0.0, 1.0));
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      const Vector3d p = mesh.vertices[a] + u * (mesh.vertices[b] - mesh.vertices[a]) +
                         v * (mesh.vertices[c] - mesh.vertices[a]);
      RC_ASSERT(std::ranges::any_of(
          pieces, [&](const Polytope& piece) { return holds(piece, p, compass); }));
    }
  }));
}

TEST(Decompose, ReachesNoFartherThanTheTolerance) {
  EXPECT_TRUE(rc::check([&] {
    const TriangleMesh mesh = arbitrary_soup();
    const double tolerance = draw(arbitrary_double(0.05, 0.5));
    for (const Polytope& piece : pieces_of(mesh, tolerance)) {
      Vector3d p = Vector3d::Zero();
      double sum = 0.0;
      for (const Vector3d& v : piece.vertices) {
        const double weight = std::pow(draw(arbitrary_double(0.0, 1.0)), 3.0);
        p += weight * v;
        sum += weight;
      }
      if (sum <= 0.0) continue;
      p /= sum;
      double least = 1e300;
      for (const auto& [a, b, c] : mesh.triangles) {
        least = std::min(
            least, sampled_distance({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}, p, 60));
      }
      RC_ASSERT(least < tolerance - piece.radius + 0.03);
    }
  }));
}

// Ground of large triangles, some of them missing, which few pieces can represent: pieces that span
// several triangles contain them and do not close the gaps.
TEST(Decompose, CoarseGroundIsHeldAndItsGapsStayOpen) {
  const auto compass = testing::directions(400);
  EXPECT_TRUE(rc::check([&] {
    const double cell = draw(arbitrary_double(0.5, 8.0));
    const double roughness = draw(arbitrary_double(0.0, 0.06));
    constexpr int kCells = 4;
    std::array<std::array<Vector3d, kCells + 1>, kCells + 1> at;
    for (int i = 0; i <= kCells; ++i) {
      for (int j = 0; j <= kCells; ++j) {
        at[i][j] = {cell * i, cell * j, roughness * draw(arbitrary_double(-1.0, 1.0))};
      }
    }
    TriangleMesh mesh;
    for (int i = 0; i < kCells; ++i) {
      for (int j = 0; j < kCells; ++j) {
        if (*rc::gen::inRange(0, 8) == 0) continue;
        add(mesh, {at[i][j], at[i + 1][j], at[i + 1][j + 1]});
        add(mesh, {at[i][j], at[i + 1][j + 1], at[i][j + 1]});
      }
    }
    const auto pieces = pieces_of(mesh);
    const auto distance = [&](const Vector3d& p) {
      double least = 1e300;
      for (const auto& [a, b, c] : mesh.triangles) {
        least = std::min(least,
                         exact_distance({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}, p));
      }
      return least;
    };
    for (const Polytope& piece : pieces) {
      for (int sample = 0; sample < 20; ++sample) {
        Vector3d p = Vector3d::Zero();
        double sum = 0.0;
        for (const Vector3d& v : piece.vertices) {
          const double weight = std::pow(draw(arbitrary_double(0.01, 1.0)), 4.0);
          p += weight * v;
          sum += weight;
        }
        RC_ASSERT(distance(p / sum) + piece.radius <= 0.05 + 1e-9);
      }
    }
    for (const auto& [a, b, c] : mesh.triangles) {
      const double u = draw(arbitrary_double(0.0, 1.0));
      const double v = draw(arbitrary_double(0.0, 1.0)) * (1.0 - u);
      const Vector3d p =
          (1.0 - u - v) * mesh.vertices[a] + u * mesh.vertices[b] + v * mesh.vertices[c];
      RC_ASSERT(std::ranges::any_of(
          pieces, [&](const Polytope& piece) { return holds(piece, p, compass); }));
    }
  }));
}

// Its triangles become kilometres long: one piece each, and nothing else changes.
TEST(Decompose, AVertexFarAwayAddsNoMorePiecesThanItHasTriangles) {
  TriangleMesh mesh = ball(2.0, 24);
  const std::size_t plain = pieces_of(mesh).size();
  const Vector3d stray = mesh.vertices[1000];
  std::size_t moved = 0;
  for (Vector3d& v : mesh.vertices) {
    if ((v - stray).norm() > 1e-9) continue;
    v = {5000.0, 3.0, 1.0};
    ++moved;
  }
  ASSERT_EQ(moved, 6U);
  const auto pieces = pieces_of(mesh);
  EXPECT_LE(pieces.size(), plain + 2 * moved);
  EXPECT_TRUE(std::ranges::any_of(pieces, [](const Polytope& piece) {
    return std::abs(signed_distance(piece, {2500.0, 1.5, 1.0})) < 2.0;
  }));
}

TEST(Decompose, AWindowStaysOpenAndARoomStaysHollow) {
  const auto wall = pieces_of(wall_with_window());
  EXPECT_LE(wall.size(), 8U);
  for (const Polytope& piece : wall) {
    EXPECT_GT(signed_distance(piece, {0, 0, 0}), 0.44);
    EXPECT_GT(signed_distance(piece, {0.94, 0, 0.44}), 0.0);
  }
  const auto shell = pieces_of(ball(2.0, 24));
  double nearest = 1e300;
  for (const Polytope& piece : shell) {
    nearest = std::min(nearest, signed_distance(piece, Vector3d::Zero()));
  }
  EXPECT_NEAR(nearest, 1.95, 0.05);
  EXPECT_LT(shell.size(), ball(2.0, 24).triangles.size() / 2);
}

TEST(Decompose, FacingEitherWayOrWithoutAreaChangesNothing) {
  TriangleMesh mesh = ball(1.0, 10);
  const auto plain = pieces_of(mesh);
  TriangleMesh inverted = mesh;
  for (auto& t : inverted.triangles) std::swap(t[1], t[2]);
  EXPECT_NEAR(static_cast<double>(pieces_of(inverted).size()), static_cast<double>(plain.size()),
              0.1 * static_cast<double>(plain.size()));
  add(mesh, {Vector3d(5, 5, 5), Vector3d(6, 6, 6), Vector3d(7, 7, 7)});
  add(mesh, {Vector3d(5, 5, 5), Vector3d(5, 5, 5), Vector3d(5, 5, 5)});
  EXPECT_EQ(pieces_of(mesh).size(), plain.size());
  TriangleMesh nothing;
  add(nothing, {Vector3d(5, 5, 5), Vector3d(6, 6, 6), Vector3d(7, 7, 7)});
  EXPECT_TRUE(pieces_of(nothing).empty());
}

TEST(Decompose, ReportsWhenItWouldTakeTooManyPieces) {
  DecompositionOptions options;
  options.tolerance = 0.01;
  options.max_pieces = 10;
  const auto pieces = decompose(ball(2.0, 40), options);
  ASSERT_FALSE(pieces);
  EXPECT_EQ(pieces.error(), "it would take more than 10 convex pieces at 10 mm");
}

TEST(Decompose, CountsThePiecesThatAreLeftAfterJoining) {
  DecompositionOptions options;
  options.tolerance = 0.01;
  const auto all = decompose(ball(0.5, 10), options);
  ASSERT_TRUE(all);
  options.max_pieces = all->size();
  EXPECT_TRUE(decompose(ball(0.5, 10), options));
  --options.max_pieces;
  EXPECT_FALSE(decompose(ball(0.5, 10), options));
}

TEST(MeshPieces, ComeBackFromTextAndHoldWhatTheyHeld) {
  MeshPieces mesh;
  mesh.key = {"model://a/b c.dae", {1, -2, 0.1}, 0xfedcba9876543210ULL};
  mesh.tolerance = 0.05;
  mesh.pieces = pieces_of(wall_with_window());
  const std::string text = to_text(mesh) + to_text(mesh);
  std::string_view rest = text;
  ASSERT_TRUE(take_mesh_pieces(rest));
  const auto read = take_mesh_pieces(rest);
  ASSERT_TRUE(read);
  EXPECT_TRUE(rest.empty());
  EXPECT_EQ(read->key.uri, mesh.key.uri);
  EXPECT_EQ(read->key.scale, mesh.key.scale);
  EXPECT_EQ(read->key.digest, mesh.key.digest);
  EXPECT_EQ(read->tolerance, 0.05);
  ASSERT_EQ(read->pieces.size(), mesh.pieces.size());
  for (std::size_t i = 0; i < mesh.pieces.size(); ++i) {
    ASSERT_EQ(read->pieces[i].vertices.size(), mesh.pieces[i].vertices.size());
    for (std::size_t k = 0; k < mesh.pieces[i].vertices.size(); ++k) {
      EXPECT_LE(
          (read->pieces[i].vertices[k] - mesh.pieces[i].vertices[k]).norm() + mesh.pieces[i].radius,
          read->pieces[i].radius + 1e-12);
    }
  }
  EXPECT_EQ(to_text(*read).size(), text.size() / 2);
}

TEST(MeshPieces, DamagedOnesAreRefused) {
  MeshPieces mesh;
  mesh.key = {"a.stl", {1, 1, 1}, 7};
  mesh.tolerance = 0.05;
  mesh.pieces = pieces_of(wall_with_window());
  const std::string text = to_text(mesh);
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string damaged = text;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    std::string_view rest = damaged;
    EXPECT_FALSE(take_mesh_pieces(rest)) << at;
    rest = std::string_view(text).substr(0, at);
    EXPECT_FALSE(take_mesh_pieces(rest)) << at;
  }
}

// A map with one mesh, in a folder of its own.
class MeshMap : public ::testing::Test {
 protected:
  MeshMap() {
    std::string pattern = (std::filesystem::temp_directory_path() / "dive-mesh-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~MeshMap() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& content) const {
    std::ofstream(folder_ / name) << content;
  }
  static std::string obj(const TriangleMesh& mesh) {
    std::string text;
    for (const Vector3d& v : mesh.vertices) {
      text += "v " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " +
              std::to_string(v.z()) + "\n";
    }
    for (const auto& t : mesh.triangles) {
      text += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " +
              std::to_string(t[2] + 1) + "\n";
    }
    return text;
  }
  void write_map(const std::string& mesh) const {
    write("map.sdf",
          "<sdf version='1.6'><model name='wall'><static>1</static><pose>10 0 -5 0 0 0</pose>\n"
          "<link name='l'><collision name='c'><geometry>\n" +
              mesh + "\n</geometry></collision></link></model></sdf>");
  }
  [[nodiscard]] std::optional<World> load(Diagnostics& diagnostics) const {
    return load_sdf((folder_ / "map.sdf").string(), diagnostics);
  }
  [[nodiscard]] std::vector<std::filesystem::path> kept() const {
    std::vector<std::filesystem::path> result;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      if (entry.path().extension() == ".pieces") result.push_back(entry.path());
    }
    return result;
  }

  std::filesystem::path folder_;
};

TEST_F(MeshMap, IsWherePoseAndScalePutIt) {
  write("wall.obj", obj(wall_with_window()));
  write_map("<mesh><uri>model://wall/wall.obj</uri><scale>1 1 2</scale></mesh>");
  Diagnostics diagnostics;
  const auto world = load(diagnostics);
  ASSERT_TRUE(world) << render(diagnostics.list().at(0), false);
  Scene scene(*world);
  EXPECT_NEAR(scene.point_distance({10, 3, -8}), 3.0, 0.05);
  EXPECT_NEAR(scene.point_distance({10, 0, -5}), 1.0, 0.05) << "in the middle of the window";
  ASSERT_EQ(world->surfaces.size(), 1U);
  EXPECT_EQ(world->surfaces[0].mesh.triangles.size(), 8U);
  EXPECT_EQ(world->obstacles[0].name, "wall/l/c");
  EXPECT_EQ(world->obstacles[0].surface, 0);
}

TEST_F(MeshMap, ItsPiecesAreKeptWhileTheMeshStaysTheSame) {
  write("wall.obj", obj(wall_with_window()));
  write_map("<mesh><uri>wall.obj</uri></mesh>");
  const auto said = [&] {
    int times = 0;
    MeshFiles files((folder_ / "map.sdf").string(), Resources::kInFolder,
                    [&](const std::string&) { ++times; });
    EXPECT_TRUE(files.find("wall.obj", Vector3d::Ones()));
    return times;
  };
  EXPECT_EQ(said(), 1);
  ASSERT_EQ(kept().size(), 1U);
  EXPECT_EQ(said(), 0);
  write("wall.obj", obj(ball(1.0, 8)));
  EXPECT_EQ(said(), 1);
  EXPECT_EQ(said(), 0);
  std::ofstream(kept()[0], std::ios::app) << "x";
  EXPECT_EQ(said(), 1) << "a damaged file is made again";
  EXPECT_EQ(said(), 0);
}

// Memory depends on the content of the file, not on the limit of a file.
TEST_F(MeshMap, OfAFewTrianglesTakesLittleMemory) {
  write("wall.obj", obj(wall_with_window()));
  for (const char* from : {"mesh", "pieces"}) {
    MeshFiles files((folder_ / "map.sdf").string());
    testing::reset_allocations();
    EXPECT_TRUE(files.find("wall.obj", Vector3d::Ones()));
    EXPECT_LT(testing::allocations().largest, 32U << 20U) << from;  // Assimp's buffer has 16 MiB.
  }
  EXPECT_EQ(kept().size(), 1U);
}

TEST_F(MeshMap, IsTheSameWorldFromItsLog) {
  write("wall.obj", obj(ball(1.0, 12)));
  MeshFiles files((folder_ / "map.sdf").string());
  const auto from_file = files.find("wall.obj", {1, 2, 3});
  ASSERT_TRUE(from_file);
  ASSERT_TRUE(files.find("wall.obj", {1, 2, 3}));
  MeshBundle bundle(files.bundle());
  const auto from_log = bundle.find("wall.obj", {1, 2, 3});
  ASSERT_TRUE(from_log);
  EXPECT_EQ(to_text(from_log->pieces), to_text(from_file->pieces));
  EXPECT_TRUE(from_log->file.mesh.triangles.empty());
  EXPECT_EQ(bundle.find("wall.obj", {1, 2, 4}).error().message, "is not in the log");
}

// The folder of the map is beside other folders of the same parent.
class MeshOutside : public MeshMap {
 protected:
  MeshOutside() {
    std::filesystem::create_directories(folder_ / "maps");
    std::filesystem::create_directories(folder_ / "wall");
    write("wall/wall.obj", obj(wall_with_window()));
  }
  [[nodiscard]] std::optional<World> load_at(const std::string& uri, Resources resources) {
    write("maps/map.sdf",
          "<sdf version='1.6'><model name='wall'><static>1</static>\n<link name='l'>"
          "<collision name='c'><geometry>\n  <mesh><uri>" +
              uri + "</uri></mesh></geometry></collision></link></model></sdf>");
    diagnostics_ = Diagnostics();
    return load_sdf((folder_ / "maps/map.sdf").string(), diagnostics_, resources);
  }

  Diagnostics diagnostics_;
};

TEST_F(MeshOutside, IsReadOnlyWhenThatIsAllowed) {
  std::filesystem::create_symlink("../wall/wall.obj", folder_ / "maps/link.obj");
  std::filesystem::create_directory_symlink("../wall", folder_ / "maps/inside");
  const std::string absolute = (folder_ / "wall/wall.obj").string();
  for (const std::string& uri :
       {std::string("../wall/wall.obj"), absolute, "file://" + absolute, std::string("link.obj"),
        std::string("file://../wall/wall.obj"), std::string("inside/wall.obj"),
        std::string("model://wall/wall.obj")}) {
    EXPECT_FALSE(load_at(uri, Resources::kInFolder)) << uri;
    ASSERT_EQ(diagnostics_.list().size(), 1U) << uri;
    const Diagnostic& found = diagnostics_.list()[0];
    EXPECT_EQ(found.code, "MAP-OUTSIDE") << uri;
    EXPECT_EQ(found.span.line, 3) << uri;
    EXPECT_GT(found.span.column, 1) << uri;
    EXPECT_NE(found.hint.find("--allow-outside"), std::string::npos);
    EXPECT_TRUE(load_at(uri, Resources::kAnywhere)) << uri;
  }
}

TEST_F(MeshOutside, IsNeitherInTheMapsOwnModelNorInTheFoldersOfTheOperator) {
  std::filesystem::copy_file(folder_ / "wall/wall.obj", folder_ / "maps/own.obj");
  EXPECT_TRUE(load_at("model://maps/own.obj", Resources::kInFolder)) << "as models/NAME/model.sdf";
  ::setenv("GZ_SIM_RESOURCE_PATH", folder_.c_str(), 1);
  EXPECT_TRUE(load_at("model://wall/wall.obj", Resources::kInFolder));
  std::filesystem::create_directory(folder_ / "models");
  ::setenv("GZ_SIM_RESOURCE_PATH", (folder_ / "models").c_str(), 1);
  EXPECT_FALSE(load_at("model://../wall/wall.obj", Resources::kInFolder));
  ::unsetenv("GZ_SIM_RESOURCE_PATH");
}

TEST_F(MeshMap, FilesThatAMeshNamesAreOfItsFolder) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  for (const char* material : {"/etc/passwd", "../outside.mtl", "pipe"}) {
    write("wall.obj", std::string("mtllib ") + material + "\n" + obj(wall_with_window()));
    EXPECT_TRUE(read_mesh((folder_ / "wall.obj").string())) << material;
    struct stat status {};
    EXPECT_TRUE(::stat(material, &status) != 0 || !is_input(status)) << material;
  }
}

struct BadMesh {
  const char* name;
  const char* file;
  const char* content;
  const char* says;
};

class BadMeshMap : public MeshMap, public ::testing::WithParamInterface<BadMesh> {};

TEST_P(BadMeshMap, IsAnErrorAtItsUri) {
  write(GetParam().file, GetParam().content);
  write_map(std::string("<mesh><uri>") + GetParam().file + "</uri></mesh>");
  Diagnostics diagnostics;
  EXPECT_FALSE(load(diagnostics));
  ASSERT_EQ(diagnostics.list().size(), 1U);
  EXPECT_EQ(diagnostics.list()[0].code, "MAP-MESH");
  EXPECT_EQ(diagnostics.list()[0].span.line, 3);
  EXPECT_NE(diagnostics.list()[0].message.find(GetParam().says), std::string::npos)
      << diagnostics.list()[0].message;
  EXPECT_TRUE(kept().empty());
}

INSTANTIATE_TEST_SUITE_P(
    All, BadMeshMap,
    ::testing::Values(
        BadMesh{"empty", "a.stl", "", "cannot be used"},
        BadMesh{"noise", "a.stl", "not a mesh at all, but some words", "cannot be used"},
        BadMesh{"torn", "a.dae", "<COLLADA version='1.4.1'><library_geometries>", "cannot be used"},
        BadMesh{"unknown", "a.xyz", "1 2 3", "cannot be used"},
        BadMesh{"points", "a.obj", "v 0 0 0\nv 1 0 0\n", "cannot be used"},
        BadMesh{"line", "a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "no area"}),
    [](const auto& each) { return std::string(each.param.name); });

TEST_F(MeshMap, ANumberThatIsNoneIsAnErrorAtItsUri) {
  std::string stl(80, ' ');  // Binary: a header, the number of triangles, 50 bytes for each.
  const auto put = [&](const auto& value) {
    stl.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(std::uint32_t{1});
  for (const float x : {0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F,
                        std::numeric_limits<float>::quiet_NaN()}) {
    put(x);
  }
  put(std::uint16_t{0});
  write("a.stl", stl);
  write_map("<mesh><uri>a.stl</uri></mesh>");
  Diagnostics diagnostics;
  EXPECT_FALSE(load(diagnostics));
  ASSERT_EQ(diagnostics.list().size(), 1U);
  EXPECT_EQ(diagnostics.list()[0].code, "MAP-MESH");
  EXPECT_NE(diagnostics.list()[0].message.find("not a finite number"), std::string::npos)
      << diagnostics.list()[0].message;
}

// The wreck is open: its walls are where a fine sampling of its triangles has them, and positions
// 0.1 m from every triangle are free.
TEST(RealMesh, AWreckIsCoveredAndStaysOpen) {
  const std::string path = DIVE_SHARED_DATA "/meshes/wreck_sunkenship/sunkenship_distort.dae";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the shared data is not here";
  const auto file = read_mesh(path);
  ASSERT_TRUE(file) << file.error();
  const TriangleMesh* mesh = &file->mesh;
  EXPECT_EQ(mesh->triangles.size(), 4171U);
  World world;
  for (Polytope& piece : pieces_of(*mesh)) {
    world.obstacles.push_back({"wreck", std::move(piece), Pose{}});
  }
  Scene scene(world);
  EXPECT_TRUE(rc::check([&] {
    const auto& [a, b, c] = mesh->triangles[*rc::gen::inRange<std::size_t>(0, 4171)];
    const double u = draw(arbitrary_double(0.0, 1.0));
    const double v = draw(arbitrary_double(0.0, 1.0)) * (1.0 - u);
    const Vector3d p = mesh->vertices[a] + u * (mesh->vertices[b] - mesh->vertices[a]) +
                       v * (mesh->vertices[c] - mesh->vertices[a]);
    RC_ASSERT(scene.point_distance(p) <= 1e-9);
    const Vector3d q = p + draw(arbitrary_vector(0.5));
    double least = 1e300;
    for (const auto& t : mesh->triangles) {
      const Vector3d& corner = mesh->vertices[t[0]];
      if ((corner - q).norm() > 6.0 + least) continue;
      least = std::min(
          least, sampled_distance({corner, mesh->vertices[t[1]], mesh->vertices[t[2]]}, q, 40));
    }
    RC_ASSERT(scene.point_distance(q) >= least - 0.05 - 0.15);
    RC_ASSERT(scene.point_distance(q) <= least + 1e-9);
  }));
}

}  // namespace
}  // namespace dive::planning
