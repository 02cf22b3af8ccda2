#include "mission/record/record_file.h"

#include <cerrno>

#include <fcntl.h>
#include <unistd.h>

namespace dive::mission {
namespace {

class SystemFile final : public RecordFile {
 public:
  explicit SystemFile(int descriptor) : descriptor_(descriptor) {}
  ~SystemFile() override { ::close(descriptor_); }
  SystemFile(const SystemFile&) = delete;
  SystemFile& operator=(const SystemFile&) = delete;

  tl::expected<void, int> write_at(std::uint64_t offset,
                                   std::span<const std::uint8_t> bytes) override {
    while (!bytes.empty()) {
      const ssize_t written =
          ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return tl::unexpected(written < 0 ? errno : EIO);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      offset += static_cast<std::uint64_t>(written);
    }
    return {};
  }

  void truncate(std::uint64_t size) override {
    static_cast<void>(::ftruncate(descriptor_, static_cast<off_t>(size)) == 0);
  }

  tl::expected<void, int> sync() override {
    if (::fdatasync(descriptor_) != 0) return tl::unexpected(errno);
    return {};
  }

 private:
  int descriptor_;
};

tl::expected<std::unique_ptr<RecordFile>, int> opened(const std::string& path, int flags) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | flags, 0644);
  if (descriptor < 0) return tl::unexpected(errno);
  return std::make_unique<SystemFile>(descriptor);
}

}  // namespace

tl::expected<std::unique_ptr<RecordFile>, int> create_record_file(const std::string& path) {
  return opened(path, O_CREAT | O_TRUNC);
}

tl::expected<std::unique_ptr<RecordFile>, int> open_record_file(const std::string& path) {
  return opened(path, 0);
}

}  // namespace dive::mission
