// A file that a reader accepts is recognised as its kind.

#include "mission/cli/file_kind.h"

#include <array>
#include <filesystem>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "common/xml.h"
#include "mission/record/log.h"
#include "planning/cloud/cloud_file.h"
#include "test/common/file_content.h"
#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using testing::own_folder;
using testing::write_here;

TEST(FileKind, EveryBeginningOfAPointCloudIsRecognised) {
  const std::string pcd = "WIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 3\n";
  const std::string ply =
      "format ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "end_header\n1 2 3\n";
  const std::string path = (own_folder() / "cloud").string();
  for (const std::string& text :
       std::array{"# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS x y z\n" + pcd,
                  "VERSION .7\nFIELDS x y z\n" + pcd, "VERSION\t.7\nFIELDS x y z\n" + pcd,
                  "FIELDS x y z\n" + pcd, "COLUMNS x y z\n" + pcd, "POINTS 1\nFIELDS x y z\n" + pcd,
                  "\n# of a scanner\n FIELDS x y z\n" + pcd, "ply\n" + ply, "ply\r\n" + ply,
                  "ply \n" + ply}) {
    write_here("cloud", text);
    const auto cloud = planning::read_cloud(path, {});
    ASSERT_TRUE(cloud) << text << cloud.error();
    EXPECT_EQ(kind_of_file(path), FileKind::kCloud) << text;
  }
}

TEST(FileKind, ALogIsRecognised) {
  const std::string path = (own_folder() / "log").string();
  auto log = LogWriter::create(path, {});
  ASSERT_TRUE(log && log->close());
  ASSERT_TRUE(LogReader::open(path));
  EXPECT_EQ(kind_of_file(path), FileKind::kLog);
}

TEST(FileKind, MissionsScenariosAndMapsAreRecognisedWithAByteOrderMarkToo) {
  const std::string path = (own_folder() / "marked").string();
  const std::string missions = std::string(DIVE_SOURCE_DIR) + "/missions/";
  for (const auto& [name, kind] :
       {std::pair("window.xml", FileKind::kMission), std::pair("maps/window.sdf", FileKind::kMap),
        std::pair("scenarios/depth_silent.xml", FileKind::kScenario)}) {
    EXPECT_EQ(kind_of_file(missions + name), kind) << name;
    write_here("marked", "\xEF\xBB\xBF" + dive::testing::content_of(missions + name));
    Diagnostics diagnostics;
    ASSERT_TRUE(read_xml(path, XmlLimits{}, diagnostics)) << name;
    EXPECT_EQ(kind_of_file(path), kind) << name;
  }
}

}  // namespace
}  // namespace dive::mission
