#include "common/input_file.h"

#include <cerrno>
#include <filesystem>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include <ext/stdio_filebuf.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace dive {
namespace {

/// Devices and inodes of the files that were opened as inputs.
class Inputs {
 public:
  void add(const struct stat& status) {
    const std::lock_guard lock(mutex_);
    files_.emplace(status.st_dev, status.st_ino);
  }
  [[nodiscard]] bool has(const struct stat& status) {
    const std::lock_guard lock(mutex_);
    return files_.contains({status.st_dev, status.st_ino});
  }

 private:
  std::mutex mutex_;
  std::set<std::pair<dev_t, ino_t>> files_;
};

Inputs& inputs() {
  static Inputs inputs;
  return inputs;
}

std::string reason(int error) {
  return error == ENOENT ? "no such file" : std::generic_category().message(error);
}

class DescriptorStream final : public std::istream {
 public:
  explicit DescriptorStream(Descriptor file)
      : std::istream(nullptr), buffer_(file.release(), std::ios::in | std::ios::binary) {
    rdbuf(&buffer_);
  }

 private:
  __gnu_cxx::stdio_filebuf<char> buffer_;  // closes the descriptor
};

}  // namespace

Descriptor::~Descriptor() {
  if (value_ >= 0) ::close(value_);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (value_ >= 0) ::close(value_);
  value_ = other.release();
  return *this;
}

int Descriptor::release() { return std::exchange(value_, -1); }

const char* kind_of_special_file(mode_t mode) {
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

tl::expected<Descriptor, std::string> open_input(const std::string& path) {
  // Asked first, because opening a device may have an effect; asked again of what was opened.
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return tl::unexpected(reason(errno));
  Descriptor file;
  if (S_ISREG(status.st_mode)) {
    file = Descriptor(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
    if (!file.is_open() || ::fstat(file.get(), &status) != 0) return tl::unexpected(reason(errno));
  }
  if (S_ISDIR(status.st_mode)) return tl::unexpected<std::string>("is a directory");
  if (!S_ISREG(status.st_mode)) {
    return tl::unexpected(
        fmt::format("is {}, not a regular file", kind_of_special_file(status.st_mode)));
  }
  inputs().add(status);
  return file;
}

tl::expected<std::unique_ptr<std::istream>, std::string> open_input_stream(
    const std::string& path) {
  tl::expected<Descriptor, std::string> file = open_input(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  return std::make_unique<DescriptorStream>(std::move(*file));
}

tl::expected<StdioFile, std::string> open_input_stdio(const std::string& path) {
  tl::expected<Descriptor, std::string> file = open_input(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  StdioFile stream(::fdopen(file->get(), "rb"));
  if (!stream) return tl::unexpected(reason(errno));
  static_cast<void>(file->release());
  return stream;
}

bool is_folder(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

bool is_regular_file(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

bool is_input(const struct stat& status) { return inputs().has(status); }

}  // namespace dive
