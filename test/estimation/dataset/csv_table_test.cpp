#include "estimation/dataset/csv_table.h"

#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/estimation/dataset/asl_folder.h"

namespace dive::estimation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CsvTable : public ::testing::Test {
 protected:
  void SetUp() override { path = testing::fresh_folder() + "/data.csv"; }

  tl::expected<IgnoredRows, std::string> read(const std::string& text) {
    testing::write_text(path, text);
    stamps.clear();
    return for_each_row(path, [this](const CsvRow& row) {
      stamps.push_back(row.utime);
      return row.fields.empty() ? std::string("a field is missing") : std::string();
    });
  }
  std::string error(const std::string& text) {
    const auto ignored = read(text);
    return ignored ? "it is read" : ignored.error();
  }

  std::string path;
  std::vector<Utime> stamps;
};

// As written by hand, by spreadsheets and by numerical tools.
TEST_F(CsvTable, ReadsEachFormOfAStamp) {
  ASSERT_TRUE(
      read("\xEF\xBB\xBF#timestamp [ns], x\n"
           "1403638128945096960.0000000000,1\r\n"
           "1403638128995097499.5,1\n"
           "1.403638129e+18,1\n"));
  EXPECT_THAT(stamps, ElementsAre(1403638128945097, 1403638128995098, 1403638129000000));
}

TEST_F(CsvTable, ReportsWhatIsNoStamp) {
  EXPECT_THAT(error("timestamp,x\n"),
              HasSubstr("data.csv:1: \"timestamp\" is not a stamp in nanoseconds; begin a header "
                        "with #"));
  for (const char* stamp : {"-7", "99999999999999999999", "1.5.3", "1.x", "nan", "1e30", ""}) {
    EXPECT_THAT(error("# x\n" + std::string(stamp) + ",1\n"),
                HasSubstr("data.csv:2: \"" + std::string(stamp) + "\" is not a stamp"));
  }
  EXPECT_THAT(error("9000,1\n5000,1\n"),
              HasSubstr("data.csv:2: its stamp 5000 is earlier than 9000 of the line before"));
}

TEST_F(CsvTable, IgnoresRepeatedStamps) {
  const auto ignored = read("1000,1\n5000,1\n5000,2\n9000,1\n9400,1\n12000,1\n");
  ASSERT_TRUE(ignored) << ignored.error();
  EXPECT_THAT(stamps, ElementsAre(1, 5, 9, 12));
  EXPECT_EQ(ignored->same_time, 2U);
  EXPECT_EQ(ignored->first_same_time, 3U);
}

TEST_F(CsvTable, RecognisesStampsThatAreNotInNanoseconds) {
  std::string milliseconds;
  std::string seconds;
  for (int k = 0; k < 400; ++k) {
    milliseconds += std::to_string(1'403'638'128'945 + 5 * k) + ",1\n";
    seconds += std::to_string(1'403'638'128.0 + 0.005 * k) + ",1\n";
  }
  for (const std::string& text : {milliseconds, seconds}) {
    EXPECT_THAT(error(text), HasSubstr("stamps are less than a microsecond after the one before: "
                                       "are they in nanoseconds?"));
  }
}

TEST_F(CsvTable, IgnoresALastLineThatIsCut) {
  for (const char* cut : {"200", "20000,", "20000", "1000,1"}) {
    const auto ignored = read("# x\n10000,1\n" + std::string(cut));
    ASSERT_TRUE(ignored) << ignored.error();
    EXPECT_EQ(ignored->cut_line, std::string(cut) == "20000," ? 0U : 3U) << cut;
  }
  EXPECT_THAT(error("10000,1\n20000\n30000,1\n"), HasSubstr("data.csv:2: a field is missing"));
}

// A disk image or a bag under that name has no lines.
TEST_F(CsvTable, DoesNotReadLinesWithoutEnd) {
  std::FILE* const file = std::fopen(path.c_str(), "wb");
  ASSERT_NE(file, nullptr);
  std::fputs("1000,1\n", file);
  ASSERT_EQ(std::fseek(file, 1L << 40, SEEK_SET), 0);  // zeros that take no space
  std::fputc(0, file);
  std::fclose(file);
  const auto read = for_each_row(path, [](const CsvRow&) { return std::string(); });
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error(), HasSubstr("data.csv:2: the line is too long"));
  std::remove(path.c_str());
}

}  // namespace
}  // namespace dive::estimation
