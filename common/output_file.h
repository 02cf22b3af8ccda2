#pragma once
// Files that results are written to: the one place that creates, replaces and closes them. Nothing
// is overwritten unless the caller says so, and then no file that is an input, and none that
// another process is writing.

#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "common/input_file.h"

namespace dive {

/// What happens to a file that exists already.
enum class Existing { kRefuse, kReplace };

/// Why a result cannot be written. The first four say that its name cannot be used, and nothing was
/// changed.
struct OutputError {
  enum class Kind {
    kExists,   ///< It exists and was not to be replaced.
    kInput,    ///< It is an input of this process.
    kLocked,   ///< Another process, or another result of this one, is written to it.
    kName,     ///< No file can be created under this name: no such folder, not permitted.
    kNotKept,  ///< The system could not store it: no space, an error of the device.
  };
  Kind kind = Kind::kNotKept;
  std::string message;  ///< "PATH: reason".
};

/// One result. From create() to its end it is locked (flock) against other processes.
class OutputFile {
 public:
  /// Creates the file atomically; of two processes one succeeds. A file that exists is opened if it
  /// may be replaced, and keeps its content until the first write. A character device (/dev/null)
  /// and a pipe with a reader are written as they are: nothing in them is overwritten. Never waits.
  /// `mode`: permissions of a new file, before the umask.
  [[nodiscard]] static tl::expected<OutputFile, OutputError> create(const std::string& path,
                                                                    Existing existing,
                                                                    mode_t mode = 0666);
  /// Creates `path`, or the first free of STEM-2.EXT, STEM-3.EXT and so on: one more than the
  /// highest number in use in the folder (newest_numbered()).
  [[nodiscard]] static tl::expected<OutputFile, OutputError> create_numbered(
      const std::string& path);

  OutputFile(OutputFile&&) noexcept = default;
  OutputFile& operator=(OutputFile&&) = delete;
  /// Removes the file again if this object created it and neither close() succeeded nor keep() was
  /// called.
  ~OutputFile();

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Appends to the result. The first call empties a file that is replaced. Buffered: an error may
  /// be reported by a later call or by close().
  [[nodiscard]] tl::expected<void, OutputError> write(std::string_view text);
  /// Everything is with the operating system, or this is an error. Ends the lock.
  [[nodiscard]] tl::expected<void, OutputError> close();
  /// The file stays, whatever becomes of it; for one that is written by other code, by its path.
  void keep() { is_ours_ = false; }

 private:
  OutputFile(std::string path, Descriptor file, bool is_new);
  [[nodiscard]] tl::expected<void, OutputError> begin();

  std::string path_;
  StdioFile stream_;
  bool is_new_ = false;
  bool is_ours_ = false;  ///< Created by this object and not to stay without content.
  bool has_begun_ = false;
};

/// create(), write() and close().
[[nodiscard]] tl::expected<void, OutputError> write_output(const std::string& path,
                                                           Existing existing,
                                                           std::string_view text);

/// STEM-N.EXT for the name STEM.EXT; N = 1 is the name itself.
[[nodiscard]] std::string numbered(const std::string& path, int number);
/// The highest number under which the folder has a file whose name begins with the numbered name
/// (a log, or what stands beside it: STEM-3.lcmlog.journal) and ends with `suffix`; 0 if none.
[[nodiscard]] int newest_numbered(const std::string& path, std::string_view suffix = {});

/// A lock that holds while this object exists, and ends with its process however that ends: an
/// flock on a file of its own, PATH.lock, so that PATH itself may be replaced meanwhile.
class FileLock {
 public:
  /// kLocked if another process has it, else the reason why there can be no lock.
  [[nodiscard]] static tl::expected<FileLock, OutputError> acquire(const std::string& path);
  FileLock(FileLock&&) noexcept = default;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();  ///< Also removes PATH.lock.

 private:
  FileLock(std::string lock_path, Descriptor file);

  std::string lock_path_;
  Descriptor file_;
};

}  // namespace dive
