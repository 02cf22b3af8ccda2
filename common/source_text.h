#pragma once
// A text file written by a person, kept as it was read so that diagnostics can quote it.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

namespace dive {

/// UTF-8's, which some editors write at the beginning of a file.
inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// A position in a file. Lines and columns count from 1, columns in bytes; 0 means "unknown".
struct Span {
  int line = 0;
  int column = 0;
  int length = 0;  ///< Bytes to underline on that line; 0 underlines one.
};

/// The source position of a line in a text assembled from several files.
struct LineOrigin {
  std::string path;
  int line = 0;
  std::string included_from;  ///< "FILE:LINE" of the inclusion; empty for the including file.
};

/// Consecutive lines of an assembled text, from `first` to the next run, that are consecutive in
/// their source file.
struct LineRun {
  int first = 1;
  LineOrigin origin;  ///< Origin of the line `first`.
};

class SourceText {
 public:
  SourceText() = default;
  SourceText(std::string path, std::string content);
  /// An assembled text; the runs are in order and the first begins in line 1.
  SourceText(std::string path, std::string content, std::vector<LineRun> runs);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& content() const { return content_; }
  /// Text of a line without its line break; empty beyond the end.
  [[nodiscard]] std::string_view line(int number) const;
  /// Source position of a line: line `number` of path(), unless the text was assembled.
  [[nodiscard]] LineOrigin origin(int number) const;
  /// The source position in words: "line 12", or "line 12 of parts/row.xml" in an included file.
  [[nodiscard]] std::string line_name(int number) const;
  [[nodiscard]] int line_count() const { return static_cast<int>(line_starts_.size()); }
  /// Line and column of a byte offset, clamped to the end.
  [[nodiscard]] Span span_at(std::size_t offset, std::size_t length) const;

 private:
  std::string path_;
  std::string content_;
  std::vector<std::size_t> line_starts_{0};
  std::vector<LineRun> runs_;
};

/// Reads a whole regular file of at most `max_bytes`. The error is a sentence with the reason ("no
/// such file", "is a directory", "larger than 4 MiB").
[[nodiscard]] tl::expected<SourceText, std::string> read_source_text(const std::string& path,
                                                                     std::size_t max_bytes);

}  // namespace dive
