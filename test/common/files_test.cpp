// Files of inputs and outputs: what is opened, what is refused, what is never overwritten.

#include <filesystem>
#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/input_file.h"
#include "common/output_file.h"
#include "common/path_beneath.h"
#include "test/common/file_content.h"

namespace dive {
namespace {

namespace fs = std::filesystem;
using Kind = OutputError::Kind;
using ::testing::HasSubstr;

class Files : public ::testing::Test {
 protected:
  Files() {
    std::string pattern = (fs::temp_directory_path() / "dive-files-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  ~Files() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_ / name).string();
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
  }
  [[nodiscard]] std::string content(const std::string& name) const {
    return dive::testing::content_of(path(name));
  }
  /// The kind of the error of creating that file; absent if it is created.
  [[nodiscard]] std::optional<Kind> refusal(const std::string& name, Existing existing) const {
    const auto file = OutputFile::create(path(name), existing);
    if (file) return std::nullopt;
    EXPECT_THAT(file.error().message, HasSubstr(path(name)));
    return file.error().kind;
  }

  fs::path folder_;
};

TEST_F(Files, WhatCannotBeExaminedIsNeitherFolderNorFile) {
  write("file", "");
  fs::create_symlink(path("loop"), path("loop"));
  EXPECT_TRUE(is_folder(folder_));
  EXPECT_TRUE(is_regular_file(path("file")));
  for (const std::string& name : {path("loop"), std::string(300, 'a'), path("none")}) {
    EXPECT_FALSE(is_folder(name)) << name;
    EXPECT_FALSE(is_regular_file(name)) << name;
  }
}

TEST_F(Files, SpecialFilesAreNoInputsAndNeverWaitedFor) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const int descriptor = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path("socket").copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  fs::create_symlink("pipe", folder_ / "link");
  fs::create_symlink("nothing", folder_ / "dangling");
  for (const auto& [name, reason] : {std::pair("pipe", "is a pipe, not a regular file"),
                                     {"link", "is a pipe, not a regular file"},
                                     {"socket", "is a socket, not a regular file"},
                                     {".", "is a directory"},
                                     {"dangling", "no such file"},
                                     {"missing", "no such file"}}) {
    EXPECT_EQ(open_input(path(name)).error(), reason) << name;
    EXPECT_EQ(open_input_stream(path(name)).error(), reason) << name;
    EXPECT_EQ(open_input_stdio(path(name)).error(), reason) << name;
  }
  EXPECT_EQ(open_input("/dev/null").error(), "is a device, not a regular file");
  ::close(descriptor);
}

TEST_F(Files, WhatExistsIsReplacedOnlyOnRequest) {
  write("old", "of yesterday");
  EXPECT_EQ(refusal("old", Existing::kRefuse), Kind::kExists);
  EXPECT_EQ(content("old"), "of yesterday");
  {
    auto file = OutputFile::create(path("old"), Existing::kReplace);
    ASSERT_TRUE(file);
    EXPECT_EQ(content("old"), "of yesterday") << "nothing is lost before there is something new";
    EXPECT_EQ(refusal("old", Existing::kReplace), Kind::kLocked);
  }
  EXPECT_EQ(content("old"), "of yesterday");
  ASSERT_TRUE(write_output(path("old"), Existing::kReplace, "new"));
  EXPECT_EQ(content("old"), "new");
}

TEST_F(Files, AnInputIsNeverAnOutputWhateverItsName) {
  write("input", "precious");
  ASSERT_TRUE(open_input(path("input")));
  fs::create_symlink("input", folder_ / "symlink");
  fs::create_hard_link(folder_ / "input", folder_ / "hardlink");
  for (const char* name : {"input", "./input", "symlink", "hardlink"}) {
    EXPECT_EQ(refusal(name, Existing::kReplace), Kind::kInput) << name;
    EXPECT_EQ(refusal(name, Existing::kRefuse), Kind::kInput) << name;
  }
  EXPECT_EQ(content("input"), "precious");

  write("later", "read after it was opened as an output");
  auto file = OutputFile::create(path("later"), Existing::kReplace);
  ASSERT_TRUE(file);
  ASSERT_TRUE(open_input(path("later")));
  EXPECT_EQ(file->write("text").error().kind, Kind::kInput);
  EXPECT_EQ(content("later"), "read after it was opened as an output");
}

TEST_F(Files, AResultThatIsNotWrittenLeavesNothing) {
  {
    const auto file = OutputFile::create(path("new"), Existing::kRefuse);
    ASSERT_TRUE(file);
    EXPECT_TRUE(fs::exists(path("new"))) << "the name is taken at once";
  }
  EXPECT_FALSE(fs::exists(path("new")));
  {
    auto file = OutputFile::create(path("new"), Existing::kRefuse);
    ASSERT_TRUE(file);
    file->keep();
  }
  EXPECT_TRUE(fs::exists(path("new")));
}

TEST_F(Files, NamesThatCannotBeWrittenAreToldFromDisksThatCannot) {
  fs::create_directory(folder_ / "folder");
  fs::create_symlink("nothing", folder_ / "dangling");
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  write("file", "");
  for (const char* name : {"folder", "dangling", "pipe", "none/file", "file/inside"}) {
    EXPECT_EQ(refusal(name, Existing::kReplace), Kind::kName) << name;
  }
  const auto full = write_output("/dev/full", Existing::kRefuse, "text");
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().kind, Kind::kNotKept);
  EXPECT_EQ(full.error().message, "/dev/full: cannot be written: No space left on device");
  EXPECT_TRUE(write_output("/dev/null", Existing::kRefuse, "text")) << "nothing is overwritten";
}

TEST_F(Files, NamesCountUpFromTheHighestInUse) {
  const auto next = [&](const std::string& name) {
    auto file = OutputFile::create_numbered(path(name));
    if (!file) return file.error().message;
    file->keep();
    return fs::path(file->path()).filename().string();
  };
  EXPECT_EQ(next("a-seed7.log"), "a-seed7.log");
  EXPECT_EQ(next("a-seed7.log"), "a-seed7-2.log");
  write("a-seed7-4.log.journal", "of a log that was moved away");
  write("a-seed7-9x.log", "another name");
  write("a-seed77.log", "another name");
  EXPECT_EQ(newest_numbered(path("a-seed7.log")), 4);
  EXPECT_EQ(newest_numbered(path("a-seed7.log"), ".journal"), 4);
  EXPECT_EQ(next("a-seed7.log"), "a-seed7-5.log");
  fs::remove(path("a-seed7.log"));
  EXPECT_EQ(next("a-seed7.log"), "a-seed7-6.log") << "no gap is filled: the newest is the highest";
  EXPECT_EQ(next("plain"), "plain");
  EXPECT_EQ(next("plain"), "plain-2");
}

/// Runs `work` in a child process and returns its exit status.
int in_child(const std::function<int()>& work) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(work());
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST_F(Files, ALockHoldsAcrossProcessesAndEndsWithItsOwner) {
  const auto is_free = [&] { return FileLock::acquire(path("journal")) ? 0 : 1; };
  {
    const auto lock = FileLock::acquire(path("journal"));
    ASSERT_TRUE(lock);
    EXPECT_EQ(in_child(is_free), 1);
    write("journal.new", "");
    fs::rename(path("journal.new"), path("journal"));
    EXPECT_EQ(in_child(is_free), 1) << "although the file was replaced";
  }
  EXPECT_FALSE(fs::exists(path("journal.lock")));
  // A process that is killed leaves its lock file, without a lock.
  EXPECT_EQ(in_child([&] {
              const auto lock = FileLock::acquire(path("journal"));
              ::_exit(lock ? 7 : 8);
              return 0;
            }),
            7);
  EXPECT_TRUE(fs::exists(path("journal.lock")));
  EXPECT_EQ(in_child(is_free), 0);
  EXPECT_EQ(FileLock::acquire(path("none/journal")).error().kind, Kind::kName);
}

TEST_F(Files, OfTwoProcessesOneCreatesAFile) {
  int start[2];
  ASSERT_EQ(::pipe(start), 0);
  const auto child = [&] {
    const pid_t pid = ::fork();
    if (pid != 0) return pid;
    char go = 0;
    const bool is_told = ::read(start[0], &go, 1) == 1;
    auto file = OutputFile::create(path("one"), Existing::kRefuse);
    if (file) file->keep();
    ::_exit(is_told && file ? 0 : 1);
  };
  const pid_t first = child();
  const pid_t second = child();
  ASSERT_EQ(::write(start[1], "go", 2), 2);
  int a = 0;
  int b = 0;
  ::waitpid(first, &a, 0);
  ::waitpid(second, &b, 0);
  EXPECT_EQ(WEXITSTATUS(a) + WEXITSTATUS(b), 1) << "one is refused";
  ::close(start[0]);
  ::close(start[1]);
}

TEST_F(Files, BeneathAFolderIsSaidOfTheFileNotOfItsName) {
  fs::create_directories(folder_ / "in/deep");
  write("in/deep/file", "");
  write("out", "");
  fs::create_symlink("../out", folder_ / "in/link");
  const fs::path in = canonical_folder_of(path("in/map.sdf"));
  EXPECT_TRUE(is_beneath(path("in/deep/file"), in));
  EXPECT_TRUE(is_beneath(path("in/deep/../deep/file"), in));
  EXPECT_FALSE(is_beneath(path("in/../out"), in));
  EXPECT_FALSE(is_beneath(path("in/link"), in));
  EXPECT_FALSE(is_beneath(path("inside"), in));
  EXPECT_FALSE(is_beneath(path("in"), in));
  EXPECT_FALSE(is_beneath(path("out"), fs::path()));
}

}  // namespace
}  // namespace dive
