#pragma once
// An error in a file written by a person: where, what, and what to do about it.

#include <string>
#include <vector>

#include "common/source_text.h"

namespace dive {

enum class Severity { kNote, kWarning, kError };

[[nodiscard]] const char* to_string(Severity severity);

struct Diagnostic {
  std::string code;  ///< Stable, e.g. "XML-DOCTYPE"; one code per rule.
  Severity severity = Severity::kError;
  std::string file;
  Span span;
  std::string message;             ///< One sentence: the error, and what was expected.
  std::string hint;                ///< What to do about it; may be empty.
  std::string source_line;         ///< The line the span points into; may be empty.
  std::string included_from = {};  ///< "FILE:LINE" that had `file` included; may be empty.
};

/// Collects diagnostics in the order found; beyond `kMaxDiagnostics` it only counts them.
class Diagnostics {
 public:
  static constexpr std::size_t kMaxDiagnostics = 200;

  void add(Diagnostic diagnostic);
  /// Adds one at `span` of `source`, with the source line filled in.
  void error(std::string code, const SourceText& source, Span span, std::string message,
             std::string hint = {});
  void warning(std::string code, const SourceText& source, Span span, std::string message,
               std::string hint = {});

  /// Adds the error FILE-UNREADABLE.
  void unreadable(const std::string& path, const std::string& reason);

  [[nodiscard]] const std::vector<Diagnostic>& list() const { return list_; }
  [[nodiscard]] std::size_t error_count() const { return error_count_; }
  [[nodiscard]] std::size_t warning_count() const { return warning_count_; }
  [[nodiscard]] bool ok() const { return error_count_ == 0; }
  /// Orders by file, line and column; equal places keep their order.
  void sort();

 private:
  void add(Severity severity, std::string code, const SourceText& source, Span span,
           std::string message, std::string hint);

  std::vector<Diagnostic> list_;
  std::size_t error_count_ = 0;
  std::size_t warning_count_ = 0;
};

/// The format of a compiler: `file:line:column: error: message [CODE]`, the source line, a caret,
/// the hint. Long lines are cut around the caret; tabs become single spaces. `color` uses ANSI.
[[nodiscard]] std::string render(const Diagnostic& diagnostic, bool color);

}  // namespace dive
