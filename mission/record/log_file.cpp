#include "mission/record/log_file.h"

#include <algorithm>
#include <utility>

#include "common/assert.h"
#include "mission/record/log_codec.h"
#include "mission/record/log_frame.h"

namespace dive::mission {
namespace {

constexpr auto kBetweenAttempts = std::chrono::seconds(1);

}  // namespace

std::vector<std::uint8_t> loss_mark(std::int64_t number, std::int64_t timestamp) {
  Packet packet;
  DIVE_DEMAND(encode(TickMark{timestamp, 0}, packet));
  std::vector<std::uint8_t> record;
  append_record({number, timestamp, 0, 0}, to_string(Channel::kTick), packet, record);
  return record;
}

LogFile::LogFile(OpenRecordFile open, std::vector<std::uint8_t> header)
    : open_(std::move(open)), header_(std::move(header)) {}

tl::expected<void, int> LogFile::begin() {
  next_attempt_ = std::chrono::steady_clock::now() + kBetweenAttempts;
  tl::expected<void, int> written;
  if (!file_) {
    auto opened = open_();
    if (opened) {
      file_ = std::move(*opened);
    } else {
      written = tl::unexpected(opened.error());
    }
  }
  if (written) written = put(header_);
  has_header_ = written.has_value();
  if (!written) error_ = written.error();
  return written;
}

bool LogFile::is_begun() {
  if (has_header_ || std::chrono::steady_clock::now() < next_attempt_) return has_header_;
  return begin().has_value();
}

tl::expected<void, int> LogFile::put(std::span<const std::uint8_t> block) {
  const tl::expected<void, int> written = file_->write_at(end_, block);
  if (written) {
    end_ += block.size();
  } else {
    file_->truncate(end_);
  }
  return written;
}

void LogFile::append(std::span<const std::uint8_t> tick) {
  if (is_begun()) {
    const std::uint64_t offset = end_;
    const tl::expected<void, int> written = put(tick);
    if (written) {
      last_tick_ = offset;
      is_marked_ = false;
      return;
    }
    error_ = written.error();
    if (!is_marked_) mark_loss(tick);
  }
  ++lost_;
}

// A full disk has no room for the mark: it then replaces the last tick, whose space the file has.
void LogFile::mark_loss(std::span<const std::uint8_t> tick) {
  FrameBytes bytes;
  DIVE_DEMAND(tick.size() >= bytes.size());
  std::copy_n(tick.begin(), bytes.size(), bytes.begin());
  const LogFrame first = *read_frame(bytes);
  const std::vector<std::uint8_t> mark = loss_mark(first.number, first.timestamp);
  is_marked_ = put(mark).has_value();
  if (is_marked_ || !last_tick_ || !file_->write_at(*last_tick_, mark)) return;
  end_ = *std::exchange(last_tick_, std::nullopt) + mark.size();
  file_->truncate(end_);
  is_marked_ = true;
  ++lost_;
}

}  // namespace dive::mission
