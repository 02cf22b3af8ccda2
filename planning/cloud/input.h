#pragma once
// A file read once from start to end through a buffer of fixed size, and number parsing.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "common/input_file.h"

namespace dive::planning {

class Input {
 public:
  /// Opens the file. Error if it is missing, not a regular file, empty or unreadable.
  [[nodiscard]] static tl::expected<Input, std::string> open(const std::string& path);

  /// The next line without its end (LF or CRLF); valid until the next call. Absent at the end of
  /// the file and for a line longer than the buffer, 1 MiB; failure() gives the cause.
  [[nodiscard]] std::optional<std::string_view> line();
  /// Reads the next bytes; false if fewer are left.
  [[nodiscard]] bool read(char* to, std::size_t bytes);
  [[nodiscard]] bool skip(std::uint64_t bytes);
  /// The next bytes, at most `bytes`, without consuming them.
  [[nodiscard]] std::string_view peek(std::size_t bytes);

  [[nodiscard]] std::uint64_t left() const { return size_ - taken_; }
  [[nodiscard]] std::uint64_t taken() const { return taken_; }
  [[nodiscard]] std::size_t line_number() const { return line_number_; }
  [[nodiscard]] const std::string& failure() const { return failure_; }

 private:
  Input(StdioFile file, std::uint64_t size);
  [[nodiscard]] std::size_t buffered() const { return end_ - begin_; }
  void fill();
  void take(std::size_t bytes);

  StdioFile file_;
  std::uint64_t size_ = 0;
  std::uint64_t taken_ = 0;
  std::size_t line_number_ = 0;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::string failure_;
};

/// The words of a line, split at blanks.
[[nodiscard]] std::vector<std::string_view> words_of(std::string_view line);
/// Removes the first word from the line and returns it; empty if there is none.
[[nodiscard]] std::string_view take_word(std::string_view& line);

/// A decimal number, nan or inf; absent if the word is anything else.
[[nodiscard]] std::optional<double> to_number(std::string_view word);
/// A non-negative integer; absent if the word is anything else.
[[nodiscard]] std::optional<std::uint64_t> to_count(std::string_view word);

/// A word of the file for a message: shortened, without control characters.
[[nodiscard]] std::string shown(std::string_view word);

}  // namespace dive::planning
