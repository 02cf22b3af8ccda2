#pragma once
// Opens files for reading. Every file that a command reads is opened here, so that no special file
// can stop it, and so that no input is ever taken as an output (output_file.h).

#include <cstdio>
#include <istream>
#include <memory>
#include <string>

#include <sys/stat.h>
#include <tl/expected.hpp>

namespace dive {

/// An open file descriptor; closed by the destructor.
class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : value_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;

  [[nodiscard]] int get() const { return value_; }
  [[nodiscard]] bool is_open() const { return value_ >= 0; }
  /// Passes the descriptor to the caller, who must close it.
  [[nodiscard]] int release();

 private:
  int value_;
};

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using StdioFile = std::unique_ptr<std::FILE, CloseFile>;

/// Opens a regular file for reading, and records it as an input of this process. Never waits:
/// pipes (also as /dev/stdin), sockets, devices and folders are refused. The error is a clause with
/// the reason: "no such file", "is a directory", "is a pipe, not a regular file".
[[nodiscard]] tl::expected<Descriptor, std::string> open_input(const std::string& path);

/// The same file as a stream, or for functions of C.
[[nodiscard]] tl::expected<std::unique_ptr<std::istream>, std::string> open_input_stream(
    const std::string& path);
[[nodiscard]] tl::expected<StdioFile, std::string> open_input_stdio(const std::string& path);

/// True if there is such a folder, or regular file, and this process may examine it.
[[nodiscard]] bool is_folder(const std::string& path);
[[nodiscard]] bool is_regular_file(const std::string& path);

/// True if this process has opened that file by one of the functions above. Files are compared by
/// device and inode, whatever their names. Any thread may call it.
[[nodiscard]] bool is_input(const struct stat& status);

/// The kind of a file that is not a regular one: "a directory", "a pipe".
[[nodiscard]] const char* kind_of_special_file(mode_t mode);

}  // namespace dive
