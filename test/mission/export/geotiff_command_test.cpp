// A GeoTIFF as the map of commands, against the same grid as ESRI ASCII.

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/mission/cli/own_folder.h"
#include "test/planning/world/written_tiff.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;
using testing::own_folder;
using testing::Ran;
using testing::run_here;

void write(const std::string& name, const std::string& text) {
  std::ofstream(own_folder() / name, std::ios::binary) << text;
}

TEST(GeoTiffCommand, IsAMapAsTheSameGridInEsriAsciiIs) {
  std::vector<float> heights;
  std::string text = "ncols 15\nnrows 15\nxllcorner -10\nyllcorner -22\ncellsize 2\n";
  for (int i = 0; i < 225; ++i) {
    heights.push_back(-8.0F - 0.125F * static_cast<float>(i % 15));
    text += fmt::format("{} ", heights.back());
  }
  write("bottom.asc", text);
  write("bottom.tif", dive::testing::tiff(15, 15, heights).bytes());
  for (const char* grid : {"bottom.asc", "bottom.tif"}) {
    const Ran shape =
        run_here(fmt::format("export {0} --format ply --output {0}.ply --force", grid));
    EXPECT_EQ(shape.status, 0) << shape.err;
    const Ran plan =
        run_here(fmt::format("plan --map {} --start -6,0,-3 --goal 12,-6,-3 --json", grid));
    EXPECT_EQ(plan.status, 0) << plan.err;
    EXPECT_THAT(plan.out, HasSubstr("\"success\""));
  }
  const std::string shape = testing::content_of((own_folder() / "bottom.tif.ply").string());
  EXPECT_THAT(shape, HasSubstr("element face 392\n"));
  EXPECT_TRUE(shape == testing::content_of((own_folder() / "bottom.asc.ply").string()));

  const Ran alone = run_here("sim bottom.tif");
  EXPECT_EQ(alone.status, 2);
  EXPECT_THAT(alone.err, HasSubstr("this is a map: give the start pose"));
}

TEST(GeoTiffCommand, DegreesAreRefusedWithWhatToDo) {
  dive::testing::Tiff degrees = dive::testing::tiff(2, 2, {-1.0F, -2.0F, -3.0F, -4.0F});
  degrees.projection(2, 4326);
  write("degrees.tif", degrees.bytes());
  const Ran plan = run_here("plan --map degrees.tif --start -6,0,-3 --goal 12,-6,-3");
  EXPECT_EQ(plan.status, 2);
  EXPECT_THAT(plan.err, HasSubstr("gdalwarp -t_srs"));
}

}  // namespace
}  // namespace dive::mission
