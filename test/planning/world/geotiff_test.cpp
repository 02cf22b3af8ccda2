// GeoTIFF grids, written here byte by byte, against the same grids as ESRI ASCII.

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "planning/world/grid.h"
#include "planning/world/sdf.h"
#include "test/planning/world/grid_folder.h"
#include "test/planning/world/written_tiff.h"

namespace dive::planning {
namespace {

using dive::testing::Tiff;
using dive::testing::tiff;
using ::testing::HasSubstr;

class GeoTiffTest : public testing::GridFolder {
 protected:
  void expect_same(const Tiff& tiff, const std::string& ascii) {
    const auto a = read_grid(file("bottom.tif", tiff.bytes()));
    const auto b = read_grid(file("bottom.asc", ascii));
    ASSERT_TRUE(a) << a.error();
    ASSERT_TRUE(b) << b.error();
    EXPECT_EQ(a->vertices, b->vertices);
    EXPECT_EQ(a->triangles, b->triangles);
  }
};

TEST_F(GeoTiffTest, IsTheSameGroundAsInEsriAscii) {
  const std::string head = "ncols 3\nnrows 2\nxllcorner -10\nyllcorner 4\ncellsize 2\n";
  const std::vector<float> heights{-12.5F, -13.0F, -14.25F, -15.0F, 2.5F, -16.5F};
  expect_same(tiff(3, 2, heights), head + "-12.5 -13 -14.25\n-15 2.5 -16.5\n");

  // No data, as a value that a 32-bit number does not hold exactly, and as one that is no number.
  Tiff unknown = tiff(3, 2, {-12.5F, -9999.1F, -14.25F, -15.0F, 2.5F, -16.5F});
  unknown.text(42113, "-9999.1");
  expect_same(unknown, head + "-12.5 -9999 -14.25\n-15 2.5 -16.5\n");
  unknown.values[1] = std::nanf("");
  unknown.text(42113, "nan");
  expect_same(unknown, head + "-12.5 -9999 -14.25\n-15 2.5 -16.5\n");

  // The place is that of the centre of the first cell.
  Tiff centre = tiff(3, 2, heights);
  centre.projection(1, 32620, 2);
  expect_same(centre,
              "ncols 3\nnrows 2\nxllcenter -10\nyllcenter 6\ncellsize 2\n"
              "-12.5 -13 -14.25\n-15 2.5 -16.5\n");

  // No projection is stated, as in an ESRI ASCII grid.
  Tiff local = tiff(3, 2, heights);
  local.fields.erase(34735);
  expect_same(local, head + "-12.5 -13 -14.25\n-15 2.5 -16.5\n");
}

TEST_F(GeoTiffTest, IsAMap) {
  std::vector<float> heights;
  for (int i = 0; i < 144; ++i) heights.push_back(-8.0F - 0.1F * static_cast<float>(i % 12));
  const std::string path = file("bottom.tif", tiff(12, 12, heights).bytes());
  ASSERT_TRUE(is_grid(path));
  Diagnostics diagnostics;
  const auto world = load_sdf(path, diagnostics);
  ASSERT_TRUE(world) << diagnostics.list().front().message;
  EXPECT_FALSE(world->obstacles.empty());
}

// GDAL would read its place from these.
TEST_F(GeoTiffTest, NeedsAndReadsNoFileBesideIt) {
  Tiff nowhere = tiff(2, 2, {-1.0F, -2.0F, -3.0F, -4.0F});
  nowhere.fields.erase(33550);
  nowhere.fields.erase(33922);
  file("bottom.tfw", "2\n0\n0\n-2\n-9\n7\n");
  file("bottom.tif.aux.xml",
       "<PAMDataset><GeoTransform>-10, 2, 0, 8, 0, -2</GeoTransform></PAMDataset>");
  const auto mesh = read_grid(file("bottom.tif", nowhere.bytes()));
  ASSERT_FALSE(mesh);
  EXPECT_THAT(mesh.error(), HasSubstr("does not say where it lies"));
}

TEST_F(GeoTiffTest, AMistakeIsNamedWithWhatToDo) {
  struct Bad {
    const char* phrase;
    std::function<void(Tiff&)> spoil;
  };
  for (const auto& [phrase, spoil] : std::initializer_list<Bad>{
           {"gdalwarp -t_srs", [](Tiff& t) { t.projection(2, 4326); }},
           {"unit of 0.3048 m: project the grid", [](Tiff& t) { t.projection(1, 2222); }},
           {"in degrees",
            [](Tiff& t) {
              t.doubles(33550, {0.0002, 0.0002, 0.0});
            }},
           {"must be square",
            [](Tiff& t) {
              t.doubles(33550, {2.0, 3.0, 0.0});
            }},
           {"with north up",
            [](Tiff& t) {
              t.fields.erase(33550);
              t.fields.erase(33922);
              t.doubles(34264, {2, 1, 0, -10, 1, -2, 0, 8, 0, 0, 0, 0, 0, 0, 0, 1});
            }},
           {"it has 2 bands: keep the one of the heights",
            [](Tiff& t) {
              t.longs(257, {1});
              t.longs(278, {1});
              t.shorts(277, {2});
              t.shorts(258, {32, 32});
              t.shorts(339, {3, 3});
              t.values.resize(6);
              t.shorts(338, {0});
            }},
           {"row 2, column 1: -32768 is no height", [](Tiff& t) { t.values[3] = -32768.0F; }},
           {"row 1, column 2: nan is no height", [](Tiff& t) { t.values[1] = std::nanf(""); }},
           {"no cell of the grid has data",
            [](Tiff& t) {
              t.values.assign(6, -1.0F);
              t.text(42113, "-1");
            }},
           {"its values are scaled",
            [](Tiff& t) {
              t.text(42112,
                     "<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.1</Item>"
                     "</GDALMetadata>");
            }},
           {"its heights are in \"ft\"",
            [](Tiff& t) {
              t.text(
                  42112,
                  "<GDALMetadata><Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item>"
                  "</GDALMetadata>");
            }},
           {"at least 2", [](Tiff& t) { t.longs(256, {1}); }},
           {"1000000 cells, and 250000 can be handled",
            [](Tiff& t) {
              t.longs(256, {1000});
              t.longs(257, {1000});
            }},
           {"its heights cannot be read", [](Tiff& t) {
              t.longs(279, {1U << 30U});
              t.values.resize(2);
            }}}) {
    Tiff bad = tiff(3, 2, {-1.0F, -2.0F, -3.0F, -4.0F, -5.0F, -6.0F});
    spoil(bad);
    const auto mesh = read_grid(file("bottom.tif", bad.bytes()));
    ASSERT_FALSE(mesh) << phrase;
    EXPECT_THAT(mesh.error(), HasSubstr(phrase));
  }
}

// Whatever the file's damage, it is refused or read, and nothing is printed by the library.
TEST_F(GeoTiffTest, DamageIsRefused) {
  const std::string whole = tiff(3, 2, {-1.0F, -2.0F, -3.0F, -4.0F, -5.0F, -6.0F}).bytes();
  ::testing::internal::CaptureStderr();
  for (std::size_t size = 4; size < whole.size(); size += 3) {
    EXPECT_FALSE(read_grid(file("cut.tif", whole.substr(0, size)))) << size;
  }
  for (std::size_t i = 4; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 0xA5);
    const auto mesh = read_grid(file("changed.tif", changed));
    EXPECT_TRUE(mesh || !mesh.error().empty());
    if (!mesh) continue;
    EXPECT_LE(mesh->vertices.size(), kMaxGridCells);
    for (const Eigen::Vector3d& v : mesh->vertices) EXPECT_LE(std::abs(v.z()), 12'000.0) << i;
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace dive::planning
