#include "common/output_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

namespace dive {
namespace {

namespace fs = std::filesystem;
using Kind = OutputError::Kind;
using Unwritten = tl::unexpected<OutputError>;

Unwritten refuse(Kind kind, const std::string& path, const std::string& reason) {
  return tl::make_unexpected(OutputError{kind, fmt::format("{}: {}", path, reason)});
}

/// True if another name would help; else the system cannot store anything.
bool is_of_the_name(int error) {
  constexpr std::array kErrors{EACCES, EPERM,  EROFS, ENOENT, ENOTDIR,     EISDIR,
                               ELOOP,  EINVAL, ENXIO, ENODEV, ENAMETOOLONG};
  return std::ranges::find(kErrors, error) != kErrors.end();
}

Unwritten refuse(int error, const std::string& path) {
  const std::string reason =
      error == ENXIO ? "is a pipe that no process reads" : std::generic_category().message(error);
  return refuse(is_of_the_name(error) ? Kind::kName : Kind::kNotKept, path,
                fmt::format("cannot be written: {}", reason));
}

Unwritten is_locked(const std::string& path) {
  return refuse(Kind::kLocked, path, "another process, or another option, is writing to it");
}

/// False only if another open file has the lock: not every file system has locks.
bool lock(const Descriptor& file) {
  return ::flock(file.get(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

bool same_file(const struct stat& a, const struct stat& b) {
  return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

/// Opens a file that exists, as far as it may be written.
tl::expected<Descriptor, OutputError> open_existing(const std::string& path, Existing existing) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    if (errno != ENOENT) return refuse(errno, path);
    return refuse(Kind::kName, path, "is a symbolic link to no file");
  }
  const bool is_regular = S_ISREG(status.st_mode);
  if (!is_regular && !S_ISCHR(status.st_mode) && !S_ISFIFO(status.st_mode)) {
    return refuse(
        Kind::kName, path,
        fmt::format("is {}, and cannot be written", kind_of_special_file(status.st_mode)));
  }
  if (is_regular && is_input(status)) {
    return refuse(Kind::kInput, path, "is an input of this command, and is never written");
  }
  if (is_regular && existing == Existing::kRefuse) {
    return refuse(Kind::kExists, path, "exists already");
  }
  Descriptor file(::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!file.is_open()) return refuse(errno, path);
  // Only opening must not wait; a slow reader of a pipe is no error.
  ::fcntl(file.get(), F_SETFL, ::fcntl(file.get(), F_GETFL) & ~O_NONBLOCK);
  if (is_regular && !lock(file)) return is_locked(path);
  return file;
}

/// The number N in STEM-N.EXT..., 1 in STEM.EXT...; 0 if `name` is none of these.
int number_of(std::string_view name, std::string_view stem, std::string_view extension) {
  if (!name.starts_with(stem)) return 0;
  name.remove_prefix(stem.size());
  if (name.starts_with(extension) && !(extension.empty() && name.starts_with('-'))) return 1;
  if (!name.starts_with('-')) return 0;
  int number = 0;
  const auto [end, error] = std::from_chars(name.data() + 1, name.data() + name.size(), number);
  if (error != std::errc() || number < 2 || number > 1'000'000) return 0;
  name.remove_prefix(static_cast<std::size_t>(end - name.data()));
  return name.starts_with(extension) ? number : 0;
}

}  // namespace

OutputFile::OutputFile(std::string path, Descriptor file, bool is_new)
    : path_(std::move(path)),
      stream_(::fdopen(file.get(), "wb")),
      is_new_(is_new),
      is_ours_(is_new) {
  if (stream_) static_cast<void>(file.release());
}

OutputFile::~OutputFile() {
  if (!stream_ || !is_ours_) return;
  struct stat ours {};
  struct stat present {};
  if (::fstat(fileno(stream_.get()), &ours) == 0 && ::stat(path_.c_str(), &present) == 0 &&
      same_file(ours, present)) {
    ::unlink(path_.c_str());
  }
}

tl::expected<OutputFile, OutputError> OutputFile::create(const std::string& path, Existing existing,
                                                         mode_t mode) {
  const int flags = O_WRONLY | O_CREAT | O_EXCL | O_NOCTTY | O_CLOEXEC;
  Descriptor file(::open(path.c_str(), flags, mode));
  if (file.is_open()) {
    if (!lock(file)) return is_locked(path);
    return OutputFile(path, std::move(file), true);
  }
  if (errno != EEXIST) return refuse(errno, path);
  tl::expected<Descriptor, OutputError> old = open_existing(path, existing);
  if (!old) return tl::unexpected(std::move(old.error()));
  return OutputFile(path, std::move(*old), false);
}

tl::expected<OutputFile, OutputError> OutputFile::create_numbered(const std::string& path) {
  for (int number = newest_numbered(path) + 1;; ++number) {
    tl::expected<OutputFile, OutputError> file = create(numbered(path, number), Existing::kRefuse);
    const bool is_taken =
        !file && (file.error().kind == Kind::kExists || file.error().kind == Kind::kInput);
    if (!is_taken) return file;
  }
}

tl::expected<void, OutputError> OutputFile::begin() {
  has_begun_ = true;
  struct stat status {};
  if (!stream_ || ::fstat(fileno(stream_.get()), &status) != 0) return refuse(errno, path_);
  if (is_new_ || !S_ISREG(status.st_mode)) return {};
  // It may have been read after it was opened here.
  if (is_input(status)) {
    return refuse(Kind::kInput, path_, "is an input of this command, and is never written");
  }
  if (::ftruncate(fileno(stream_.get()), 0) != 0) return refuse(errno, path_);
  return {};
}

tl::expected<void, OutputError> OutputFile::write(std::string_view text) {
  if (!has_begun_) {
    if (const auto begun = begin(); !begun) return begun;
  }
  if (text.empty()) return {};
  errno = EIO;
  if (std::fwrite(text.data(), 1, text.size(), stream_.get()) == text.size()) return {};
  return refuse(Kind::kNotKept, path_,
                fmt::format("cannot be written: {}", std::generic_category().message(errno)));
}

tl::expected<void, OutputError> OutputFile::close() {
  if (const auto begun = write({}); !begun) return begun;
  errno = EIO;
  bool is_whole = std::ferror(stream_.get()) == 0 && std::fflush(stream_.get()) == 0;
  int error = errno;
  if (is_whole) {
    is_whole = std::fclose(stream_.release()) == 0;
    error = errno;
  }
  if (is_whole) return {};
  if (!stream_ && is_ours_) ::unlink(path_.c_str());
  return refuse(Kind::kNotKept, path_,
                fmt::format("cannot be written: {}", std::generic_category().message(error)));
}

tl::expected<void, OutputError> write_output(const std::string& path, Existing existing,
                                             std::string_view text) {
  tl::expected<OutputFile, OutputError> file = OutputFile::create(path, existing);
  if (!file) return tl::unexpected(std::move(file.error()));
  if (auto written = file->write(text); !written) return written;
  return file->close();
}

std::string numbered(const std::string& path, int number) {
  if (number == 1) return path;
  const fs::path name(path);
  const std::string extension = name.extension().string();
  return fmt::format("{}-{}{}", path.substr(0, path.size() - extension.size()), number, extension);
}

int newest_numbered(const std::string& path, std::string_view suffix) {
  const fs::path wanted(path);
  const std::string stem = wanted.stem().string();
  const std::string extension = wanted.extension().string();
  const fs::path folder = wanted.has_parent_path() ? wanted.parent_path() : fs::path(".");
  int newest = 0;
  std::error_code error;  // a folder that cannot be listed is reported when the file is created
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.ends_with(suffix)) newest = std::max(newest, number_of(name, stem, extension));
  }
  return newest;
}

FileLock::FileLock(std::string lock_path, Descriptor file)
    : lock_path_(std::move(lock_path)), file_(std::move(file)) {}

FileLock::~FileLock() {
  if (file_.is_open()) ::unlink(lock_path_.c_str());
}

tl::expected<FileLock, OutputError> FileLock::acquire(const std::string& path) {
  const std::string lock_path = path + ".lock";
  for (;;) {
    const int flags = O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC;
    Descriptor file(::open(lock_path.c_str(), flags, 0666));
    if (!file.is_open()) return refuse(errno, lock_path);
    if (!lock(file)) return is_locked(path);
    // Its former owner may have removed it between the two calls: then it locks nothing.
    struct stat locked {};
    struct stat present {};
    if (::fstat(file.get(), &locked) == 0 && ::stat(lock_path.c_str(), &present) == 0 &&
        same_file(locked, present)) {
      return FileLock(lock_path, std::move(file));
    }
  }
}

}  // namespace dive
