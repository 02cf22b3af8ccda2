#pragma once
// A file that log and journal write from their threads. Tests replace it with one of a disk that
// stalls or is full.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include <tl/expected.hpp>

namespace dive::mission {

class RecordFile {
 public:
  virtual ~RecordFile() = default;

  /// Writes all of `bytes` at `offset`. The error is that of errno; a part may then be written.
  [[nodiscard]] virtual tl::expected<void, int> write_at(std::uint64_t offset,
                                                         std::span<const std::uint8_t> bytes) = 0;
  /// Cuts the file to `size` bytes.
  virtual void truncate(std::uint64_t size) = 0;
  /// Waits until everything written so far is on the disk.
  [[nodiscard]] virtual tl::expected<void, int> sync() = 0;
};

/// Opens a file; the error is that of errno.
using OpenRecordFile = std::function<tl::expected<std::unique_ptr<RecordFile>, int>()>;

/// An empty file, in the place of any older one.
[[nodiscard]] tl::expected<std::unique_ptr<RecordFile>, int> create_record_file(
    const std::string& path);
/// An existing file with its content.
[[nodiscard]] tl::expected<std::unique_ptr<RecordFile>, int> open_record_file(
    const std::string& path);

}  // namespace dive::mission
