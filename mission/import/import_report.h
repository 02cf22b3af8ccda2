#pragma once
// The result of an import: everything that was changed, omitted, added or not understood. Content
// carried over unchanged is not listed.

#include <string>
#include <utility>
#include <vector>

#include "common/diagnostic.h"
#include "common/source_text.h"

namespace dive::mission {

/// Merges findings with the same code and message into one diagnostic, at the first position, that
/// lists the lines of all of them.
class ImportReport {
 public:
  /// Sets the file that later findings point into.
  void set_source(SourceText source) { source_ = std::move(source); }
  [[nodiscard]] const SourceText& source() const { return source_; }

  /// `detail` is the part that differs between findings, such as "3 s becomes 6 s".
  void note(std::string code, Span span, std::string message, std::string detail = {});
  void warning(std::string code, Span span, std::string message, std::string detail = {},
               std::string hint = {});
  void error(std::string code, Span span, std::string message, std::string hint = {});
  /// Adds the diagnostics of another reader unchanged.
  void add(const Diagnostics& found);

  /// True if there was no error so far.
  [[nodiscard]] bool ok() const { return !has_error_; }
  /// Diagnostics in the order of the file.
  [[nodiscard]] Diagnostics diagnostics() const;

 private:
  struct Place {
    Span span;
    std::string detail;
  };
  struct Finding {
    Severity severity;
    std::string code;
    std::string message;
    std::string hint;
    std::vector<Place> places;
  };

  void find(Severity severity, std::string code, Span span, std::string message, std::string detail,
            std::string hint);
  [[nodiscard]] static std::string text_of(const Finding& finding);

  SourceText source_;
  std::vector<Finding> findings_;
  std::vector<Diagnostic> others_;
  bool has_error_ = false;
};

}  // namespace dive::mission
