// What a build without GDAL says of a GeoTIFF.

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/diagnostic.h"
#include "planning/world/sdf.h"

namespace dive::planning {
namespace {

using ::testing::HasSubstr;

TEST(WithoutGdal, AGeoTiffIsRefusedWithHowToConvertIt) {
  const std::string path =
      (std::filesystem::temp_directory_path() / fmt::format("dive-{}.tif", getpid())).string();
  for (const std::string& magic :
       {std::string("II*\0\x08\0\0\0", 8), std::string("MM\0*\0\0\0\x08", 8),
        std::string("II+\0\x08\0\0\0", 8), std::string("MM\0+\0\x08\0\0", 8)}) {
    std::ofstream(path, std::ios::binary) << magic;
    Diagnostics diagnostics;
    EXPECT_FALSE(load_sdf(path, diagnostics));
    ASSERT_EQ(diagnostics.error_count(), 1U);
    EXPECT_THAT(diagnostics.list().front().message, HasSubstr("no GDAL"));
    EXPECT_THAT(diagnostics.list().front().message,
                HasSubstr(fmt::format("gdal_translate -of AAIGrid {}", path)));
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace dive::planning
