#include "planning/cloud/input.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <utility>

namespace dive::planning {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr std::string_view kBlanks = " \t\r\v\f";

}  // namespace

Input::Input(StdioFile file, std::uint64_t size)
    : file_(std::move(file)), size_(size), buffer_(kBufferBytes) {}

tl::expected<Input, std::string> Input::open(const std::string& path) {
  tl::expected<StdioFile, std::string> file = open_input_stdio(path);
  if (!file) return tl::unexpected("it cannot be opened: " + file.error());
  struct stat status {};
  if (::fstat(fileno(file->get()), &status) != 0 || status.st_size == 0) {
    return tl::unexpected(std::string("it is empty"));
  }
  return Input(std::move(*file), static_cast<std::uint64_t>(status.st_size));
}

void Input::fill() {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, buffered());
    end_ -= begin_;
    begin_ = 0;
  }
  // At most the length at opening: another process may be writing to the file.
  const auto wanted =
      static_cast<std::size_t>(std::min<std::uint64_t>(buffer_.size() - end_, left() - buffered()));
  end_ += std::fread(buffer_.data() + end_, 1, wanted, file_.get());
}

void Input::take(std::size_t bytes) {
  begin_ += bytes;
  taken_ += bytes;
}

std::optional<std::string_view> Input::line() {
  const auto find = [this] {
    return buffered() == 0 ? nullptr : std::memchr(buffer_.data() + begin_, '\n', buffered());
  };
  const void* found = find();
  if (found == nullptr) {
    fill();
    found = find();
  }
  if (found == nullptr && buffered() == buffer_.size()) {
    failure_ = "line " + std::to_string(line_number_ + 1) + " is longer than 1 MiB";
    return std::nullopt;
  }
  if (buffered() == 0) {
    failure_ = "the file ends after line " + std::to_string(line_number_);
    return std::nullopt;
  }
  const char* start = buffer_.data() + begin_;
  const std::size_t length =
      found == nullptr ? buffered()
                       : static_cast<std::size_t>(static_cast<const char*>(found) - start);
  std::string_view result(start, length);
  take(found == nullptr ? length : length + 1);
  ++line_number_;
  if (result.ends_with('\r')) result.remove_suffix(1);
  return result;
}

bool Input::read(char* to, std::size_t bytes) {
  if (bytes > left()) return false;
  const std::size_t ready = std::min(bytes, buffered());
  if (ready > 0) std::memcpy(to, buffer_.data() + begin_, ready);
  take(ready);
  if (ready == bytes) return true;
  const std::size_t rest = bytes - ready;
  const std::size_t count = std::fread(to + ready, 1, rest, file_.get());
  taken_ += count;
  return count == rest;
}

bool Input::skip(std::uint64_t bytes) {
  if (bytes > left()) return false;
  while (bytes > 0) {
    if (buffered() == 0) fill();
    if (buffered() == 0) return false;
    const auto step = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, buffered()));
    take(step);
    bytes -= step;
  }
  return true;
}

std::string_view Input::peek(std::size_t bytes) {
  if (buffered() < bytes) fill();
  return {buffer_.data() + begin_, std::min(bytes, buffered())};
}

std::string_view take_word(std::string_view& line) {
  const std::size_t start = line.find_first_not_of(kBlanks);
  if (start == std::string_view::npos) {
    line = {};
    return {};
  }
  line.remove_prefix(start);
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
    words.push_back(word);
  }
  return words;
}

std::optional<double> to_number(std::string_view word) {
  if (word.starts_with('+')) {
    word.remove_prefix(1);
    if (word.starts_with('-')) return std::nullopt;
  }
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) {
    const bool tiny =
        word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    return tiny ? 0.0 : std::numeric_limits<double>::infinity();
  }
  if (error != std::errc{}) return std::nullopt;
  return value;
}

std::optional<std::uint64_t> to_count(std::string_view word) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::string shown(std::string_view word) {
  constexpr std::size_t kMaxLength = 40;
  std::string result(word.substr(0, kMaxLength));
  for (char& c : result) {
    if (c < ' ' || c > '~') c = '?';
  }
  return word.size() > kMaxLength ? result + "..." : result;
}

}  // namespace dive::planning
