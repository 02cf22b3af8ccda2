#include "mission/record/log_events.h"

#include <array>
#include <cerrno>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

namespace dive::mission {
namespace {

constexpr std::uint32_t kSyncWord = 0xEDA1DA01U;
constexpr std::size_t kFrameSize = 28;
constexpr std::size_t kMaxChannelSize = 63;  // LCM_MAX_CHANNEL_NAME_LENGTH

std::uint64_t big_endian(const std::uint8_t* bytes, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value = (value << 8U) | bytes[i];
  return value;
}

}  // namespace

tl::expected<LogEventFile, std::string> LogEventFile::open(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return tl::unexpected(fmt::format("cannot read '{}': no such file", path));
  }
  if (!std::filesystem::is_regular_file(status)) {
    return tl::unexpected(fmt::format("cannot read '{}': not a regular file", path));
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::FILE* file = error ? nullptr : std::fopen(path.c_str(), "rb");
  if (file == nullptr) {
    const std::string reason = std::generic_category().message(error ? error.value() : errno);
    return tl::unexpected(fmt::format("cannot read '{}': {}", path, reason));
  }
  return LogEventFile(file, size);
}

bool LogEventFile::read(void* to, std::size_t size) {
  if (size > left_ || std::fread(to, 1, size, file_.get()) != size) return false;
  left_ -= size;
  return true;
}

LogEventFile::Read LogEventFile::next(LogEvent& event) {
  if (left_ == 0) return Read::kEnd;
  std::array<std::uint8_t, kFrameSize> frame;
  if (!read(frame.data(), frame.size())) return Read::kDamaged;
  if (big_endian(&frame[0], 4) != kSyncWord) return Read::kDamaged;
  event.number = static_cast<std::int64_t>(big_endian(&frame[4], 8));
  event.timestamp = static_cast<Utime>(big_endian(&frame[12], 8));
  const std::uint64_t channel_size = big_endian(&frame[20], 4);
  const std::uint64_t data_size = big_endian(&frame[24], 4);

  std::array<char, kMaxChannelSize> name;
  if (channel_size > name.size() || !read(name.data(), channel_size)) return Read::kDamaged;
  const auto channel = find_channel({name.data(), channel_size});
  if (!channel || data_size > max_packet_size(*channel) || data_size > left_) {
    return Read::kDamaged;
  }
  event.channel = *channel;
  event.data.resize(data_size);
  return read(event.data.data(), data_size) ? Read::kEvent : Read::kDamaged;
}

}  // namespace dive::mission
