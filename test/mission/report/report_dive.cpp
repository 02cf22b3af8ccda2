#include "test/mission/report/report_dive.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "test/mission/cli/run_command.h"

namespace dive::mission::testing {

namespace fs = std::filesystem;

namespace {

std::string place() { return ::testing::UnitTest::GetInstance()->current_test_info()->name(); }

}  // namespace

std::string folder_of_test() {
  const fs::path folder = fs::path(::testing::TempDir()) / "dive-command" / place();
  fs::create_directories(folder);
  return folder.string();
}

ReportedDive dive_and_report(const std::string& arguments) {
  ReportedDive dived;
  dived.folder = folder_of_test();
  dived.log = dived.folder + "/dive.lcmlog";
  dived.page_path = dived.folder + "/dive.html";
  const Ran ran = run_dive("run " + arguments + " --log dive.lcmlog --json --force", place());
  dived.run = nlohmann::json::parse(ran.out);
  const Ran reported = run_dive("report dive.lcmlog --output dive.html --force", place());
  EXPECT_EQ(reported.status, 0) << reported.err;
  EXPECT_EQ(reported.err, "");
  dived.page = content_of(dived.page_path);
  return dived;
}

void rewrite_log(const std::string& from, const std::string& to,
                 const std::function<void(LogHeader&)>& change_header,
                 const std::function<void(LoggedTick&)>& change) {
  auto reader = LogReader::open(from);
  ASSERT_TRUE(reader) << reader.error();
  LogHeader header = *reader->header();
  change_header(header);
  auto writer = LogWriter::create(to, header);
  ASSERT_TRUE(writer) << writer.error();
  while (auto tick = reader->next()) {
    change(*tick);
    ASSERT_TRUE(writer->write(tick->inputs, tick->outputs, tick->truth));
  }
  ASSERT_TRUE(writer->close());
}

}  // namespace dive::mission::testing
