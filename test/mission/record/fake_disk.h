#pragma once
// A disk in memory that can be full, stalled or missing.

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "mission/record/record_file.h"

namespace dive::mission::testing {

/// One file. The content may be read when no thread writes.
class FakeDisk {
 public:
  explicit FakeDisk(std::size_t room = 1U << 30U) : room_(room) {}

  static OpenRecordFile open(const std::shared_ptr<FakeDisk>& disk) {
    return [disk]() -> tl::expected<std::unique_ptr<RecordFile>, int> {
      if (disk->is_missing_) return tl::unexpected(ENOSPC);
      return std::make_unique<File>(disk);
    };
  }

  /// Size of the largest file it can hold, bytes; a write beyond fails after a part.
  void set_room(std::size_t bytes) { room_ = bytes; }
  void set_missing(bool is_missing) { is_missing_ = is_missing; }
  void stall() { is_stalled_ = true; }
  void go_on() {
    is_stalled_ = false;
    is_stalled_.notify_all();
  }
  [[nodiscard]] const std::string& content() const { return content_; }
  void set_content(std::string content) { content_ = std::move(content); }
  [[nodiscard]] int syncs() const { return syncs_; }

 private:
  class File final : public RecordFile {
   public:
    explicit File(std::shared_ptr<FakeDisk> disk) : disk_(std::move(disk)) {}
    tl::expected<void, int> write_at(std::uint64_t offset,
                                     std::span<const std::uint8_t> bytes) override {
      disk_->is_stalled_.wait(true);
      const std::size_t room = disk_->room_ - std::min<std::size_t>(disk_->room_, offset);
      const auto part = bytes.first(std::min(room, bytes.size()));
      disk_->content_.resize(std::max<std::size_t>(disk_->content_.size(), offset + part.size()));
      std::ranges::copy(part, disk_->content_.begin() + static_cast<std::ptrdiff_t>(offset));
      if (part.size() < bytes.size()) return tl::unexpected(ENOSPC);
      return {};
    }
    void truncate(std::uint64_t size) override { disk_->content_.resize(size); }
    tl::expected<void, int> sync() override {
      disk_->is_stalled_.wait(true);
      ++disk_->syncs_;
      return {};
    }

   private:
    std::shared_ptr<FakeDisk> disk_;
  };

  std::string content_;
  std::atomic<std::size_t> room_;
  std::atomic<bool> is_stalled_ = false;
  std::atomic<bool> is_missing_ = false;
  std::atomic<int> syncs_ = 0;
};

}  // namespace dive::mission::testing
