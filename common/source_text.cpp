#include "common/source_text.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>

#include <fmt/format.h>
#include <unistd.h>

#include "common/assert.h"
#include "common/input_file.h"

namespace dive {

SourceText::SourceText(std::string path, std::string content)
    : path_(std::move(path)), content_(std::move(content)) {
  for (std::size_t i = 0; i < content_.size(); ++i) {
    if (content_[i] == '\n') line_starts_.push_back(i + 1);
  }
}

SourceText::SourceText(std::string path, std::string content, std::vector<LineRun> runs)
    : SourceText(std::move(path), std::move(content)) {
  DIVE_DEMAND(!runs.empty() && runs.front().first == 1);
  runs_ = std::move(runs);
}

LineOrigin SourceText::origin(int number) const {
  if (runs_.empty() || number < 1) return {path_, number, {}};
  const auto begins_later = [](int line, const LineRun& run) { return line < run.first; };
  const auto next = std::upper_bound(runs_.begin(), runs_.end(), number, begins_later);
  const LineRun& run = *std::prev(next);
  return {run.origin.path, run.origin.line + number - run.first, run.origin.included_from};
}

std::string SourceText::line_name(int number) const {
  const LineOrigin from = origin(number);
  return from.path == path_ ? fmt::format("line {}", from.line)
                            : fmt::format("line {} of {}", from.line, from.path);
}

std::string_view SourceText::line(int number) const {
  if (number < 1 || number > line_count()) return {};
  const std::size_t begin = line_starts_[static_cast<std::size_t>(number - 1)];
  std::size_t end =
      number < line_count() ? line_starts_[static_cast<std::size_t>(number)] - 1 : content_.size();
  if (end > begin && content_[end - 1] == '\r') --end;
  return std::string_view(content_).substr(begin, end - begin);
}

Span SourceText::span_at(std::size_t offset, std::size_t length) const {
  offset = std::min(offset, content_.size());
  const auto next = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  const auto index = static_cast<std::size_t>(next - line_starts_.begin()) - 1;
  return Span{static_cast<int>(index + 1), static_cast<int>(offset - line_starts_[index] + 1),
              static_cast<int>(length)};
}

tl::expected<SourceText, std::string> read_source_text(const std::string& path,
                                                       std::size_t max_bytes) {
  const tl::expected<Descriptor, std::string> file = open_input(path);
  if (!file) return tl::unexpected(file.error());
  // Bounds the bytes read, not the size before reading: the file may grow meanwhile.
  constexpr std::size_t kChunk = 1U << 16U;
  std::string content;
  struct stat status {};
  if (::fstat(file->get(), &status) == 0 && status.st_size > 0) {
    content.reserve(std::min(static_cast<std::size_t>(status.st_size), max_bytes) + kChunk);
  }
  while (content.size() <= max_bytes) {
    const std::size_t begin = content.size();
    content.resize(std::min(begin + kChunk, max_bytes + 1));
    const ssize_t count = ::read(file->get(), content.data() + begin, content.size() - begin);
    content.resize(begin + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    if (count < 0 && errno != EINTR) return tl::unexpected<std::string>(std::strerror(errno));
    if (count == 0) break;
  }
  if (content.size() > max_bytes) {
    return tl::unexpected(fmt::format("is larger than {} KiB", max_bytes / 1024));
  }
  return SourceText(path, std::move(content));
}

}  // namespace dive
