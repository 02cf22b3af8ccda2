#pragma once
// The file of a log, as its thread writes it: whole ticks only. A tick that the disk refuses is
// lost, and where that happened the file gets a mark (a DIVE_TICK without its events), so that
// readers report a gap even if nothing follows. Private to mission/record.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <tl/expected.hpp>

#include "mission/record/record_file.h"

namespace dive::mission {

/// The record that marks lost events, the first of which has `number`.
[[nodiscard]] std::vector<std::uint8_t> loss_mark(std::int64_t number, std::int64_t timestamp);

class LogFile {
 public:
  /// `header` is the first record. Opens nothing yet.
  LogFile(OpenRecordFile open, std::vector<std::uint8_t> header);

  /// Opens the file and writes the header. The error is that of errno; append() tries again, once a
  /// second.
  [[nodiscard]] tl::expected<void, int> begin();
  /// Appends the records of one tick, or nothing.
  void append(std::span<const std::uint8_t> tick);

  /// Number of ticks lost so far, and the last error (errno; 0: none). From any thread.
  [[nodiscard]] std::int64_t lost() const { return lost_.load(); }
  [[nodiscard]] int error() const { return error_.load(); }

 private:
  [[nodiscard]] bool is_begun();
  [[nodiscard]] tl::expected<void, int> put(std::span<const std::uint8_t> block);
  void mark_loss(std::span<const std::uint8_t> tick);

  const OpenRecordFile open_;
  const std::vector<std::uint8_t> header_;
  std::unique_ptr<RecordFile> file_;
  std::uint64_t end_ = 0;                   // Bytes.
  std::optional<std::uint64_t> last_tick_;  // Offset of the last record set, unless it is a mark.
  bool has_header_ = false;
  bool is_marked_ = false;
  std::chrono::steady_clock::time_point next_attempt_;
  std::atomic<std::int64_t> lost_ = 0;
  std::atomic<int> error_ = 0;
};

}  // namespace dive::mission
