// Bathymetric grids as maps.

#include "planning/world/grid.h"

#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "planning/world/scene.h"
#include "planning/world/sdf.h"
#include "planning/world/sounding.h"
#include "test/planning/world/grid_folder.h"

namespace dive::planning {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class GridTest : public testing::GridFolder {
 protected:
  std::string file(const std::string& text) { return GridFolder::file("bottom.asc", text); }
};

const std::string kHead = "ncols 3\nnrows 2\nxllcorner -10\nyllcorner 4\ncellsize 2\n";

TEST_F(GridTest, HasVerticesAtTheCentresOfTheCellsFromNorthToSouth) {
  const auto mesh =
      read_grid(file("NCOLS 3\r\nNROWS 2\r\nXLLCENTER -9\r\nYLLCORNER 4\r\nCELLSIZE "
                     "2\r\nNODATA_value -1\r\n-12 -13 -14\r\n-15 -1 -16.5\r\n"));
  ASSERT_TRUE(mesh) << mesh.error();
  ASSERT_EQ(mesh->vertices.size(), 6U);
  EXPECT_EQ(mesh->vertices[0], Eigen::Vector3d(-9.0, 7.0, -12.0));
  EXPECT_EQ(mesh->vertices[2], Eigen::Vector3d(-5.0, 7.0, -14.0));
  EXPECT_EQ(mesh->vertices[5], Eigen::Vector3d(-5.0, 5.0, -16.5));
  EXPECT_EQ(mesh->vertices[4].z(), 0.0) << "without data it is solid up to the surface";
  ASSERT_EQ(mesh->triangles.size(), 4U);
  for (const auto& [a, b, c] : mesh->triangles) {
    const Eigen::Vector3d normal =
        (mesh->vertices[b] - mesh->vertices[a]).cross(mesh->vertices[c] - mesh->vertices[a]);
    EXPECT_GT(normal.z(), 0.0) << "the ground faces up";
  }
}

TEST_F(GridTest, IsAMapWhoseGroundIsThatOfTheGrid) {
  std::string text = "ncols 21\nnrows 21\nxllcenter -20\nyllcenter -20\ncellsize 2\n";
  const auto height = [](double x, double y) { return -10.0 + 0.2 * x - 0.1 * y; };
  for (int row = 0; row < 21; ++row) {
    for (int column = 0; column < 21; ++column) {
      const bool is_unknown = row < 2 && column > 15;
      text += is_unknown ? "-9999 " : fmt::format("{} ", height(-20 + 2 * column, 20 - 2 * row));
    }
    text += "\n";
  }
  Diagnostics diagnostics;
  const auto world = load_sdf(file(text), diagnostics);
  ASSERT_TRUE(world);
  EXPECT_FALSE(fs::is_empty(folder_));
  const Scene scene(*world);
  using Place = std::pair<double, double>;
  for (const auto& [x, y] : {Place{0.3, 0.7}, Place{-17.1, 12.9}, Place{11.0, -19.0}}) {
    const auto ground = ground_below(scene, {x, y, 0.0});
    ASSERT_TRUE(ground) << x << " " << y;
    EXPECT_NEAR(*ground, height(x, y), 0.06);
  }
  const auto unknown = ground_below(scene, {16.0, 19.0, 0.0});
  ASSERT_TRUE(unknown);
  EXPECT_NEAR(*unknown, 0.0, 0.06) << "nothing leads where the ground is not known";
}

TEST_F(GridTest, AMistakeIsNamedWithItsLine) {
  struct Bad {
    std::string text;
    const char* phrase;
  };
  for (const Bad& bad : std::initializer_list<Bad>{
           {"ncols 3\nnrows 2\ncellsize 2\n1 2 3\n4 5 6\n", "a grid begins with ncols"},
           {kHead + "-1 -2 -3\n-4 -5\n", "the file ends before the value of row 2, column 3"},
           {kHead + "-1 -2 -3\n-4 deep -6\n",
            "line 7: the value of row 2, column 2 must be a number"},
           {kHead + "-1 -2,5 -3\n-4 -5 -6\n", "not \"-2,5\""},
           {kHead + "-1 nan -3\n-4 -5 -6\n", "must be a number, not \"nan\""},
           {kHead + "-1 -2 -3\n-4 -5 -6 -7\n", "line 7: there are more values than 2 rows of 3"},
           {kHead + "-1 -2 -3\n-4 -32768 -6\n", "write NODATA_value -32768"},
           {kHead + "-9999 -9999 -9999\n-9999 -9999 -9999\n", "no cell of the grid has data"},
           {"ncols 3\nnrows 2\nxllcorner -63.5\nyllcorner 44\ncellsize 0.0002\n1 2 3 4 5 6\n",
            "is in degrees: project the grid"},
           {"ncols 1\nnrows 2\nxllcorner 0\nyllcorner 4\ncellsize 2\n1 2\n", "at least 2"},
           {"ncols 2000\nnrows 2000\nxllcorner 0\nyllcorner 4\ncellsize 2\n1 2\n",
            "4000000 cells, and 250000 can be handled"},
           {"ncols many\n", "line 1: ncols must be a number"}}) {
    const auto mesh = read_grid(file(bad.text));
    ASSERT_FALSE(mesh) << bad.text;
    EXPECT_THAT(mesh.error(), HasSubstr(bad.phrase));
  }
  Diagnostics diagnostics;
  EXPECT_FALSE(load_sdf(file(kHead), diagnostics));
  EXPECT_EQ(diagnostics.list().front().code, "MAP-MESH");
}

}  // namespace
}  // namespace dive::planning
