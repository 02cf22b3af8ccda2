#pragma once
// A file a person wrote, kept as it was read so that diagnostics can show it.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

namespace dive {

/// A place in a file. Lines and columns count from 1, columns in bytes; 0 means "not known".
struct Span {
  int line = 0;
  int column = 0;
  int length = 0;  ///< Bytes to underline, on that line; 0 underlines one.
};

/// Where a line of a text that was put together from several files was written.
struct LineOrigin {
  std::string path;
  int line = 0;
  std::string included_from;  ///< "FILE:LINE"; empty in the file that includes the others.
};

/// Lines of such a text, from `first` to the next run, that were written one below the other.
struct LineRun {
  int first = 1;
  LineOrigin origin;  ///< Of the first.
};

class SourceText {
 public:
  SourceText() = default;
  SourceText(std::string path, std::string content);
  /// Put together; the runs are in order and the first begins in line 1.
  SourceText(std::string path, std::string content, std::vector<LineRun> runs);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& content() const { return content_; }
  /// Text of a line without its line break; empty beyond the end.
  [[nodiscard]] std::string_view line(int number) const;
  /// Where that line was written: line `number` of path(), unless the text was put together.
  [[nodiscard]] LineOrigin origin(int number) const;
  /// That in words: "line 12", of another file "line 12 of parts/row.xml".
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

/// Reads a whole regular file of at most `max_bytes`. The error is a sentence that says what is
/// wrong ("no such file", "is a directory", "larger than 4 MiB").
[[nodiscard]] tl::expected<SourceText, std::string> read_source_text(const std::string& path,
                                                                     std::size_t max_bytes);

}  // namespace dive
