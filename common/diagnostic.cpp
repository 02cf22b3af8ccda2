#include "common/diagnostic.h"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

namespace dive {
namespace {

constexpr std::size_t kMaxShownLine = 110;
constexpr std::size_t kContextBeforeCaret = 60;

// Shows control bytes as '?': a terminal would act on them, and file contents are not trusted.
std::string printable(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\t') {
      c = ' ';
    } else if (byte < 0x20 || byte == 0x7F) {
      c = '?';
    }
  }
  return result;
}

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

// Columns count bytes, but the caret is placed by characters.
std::size_t display_width(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return !is_continuation(c); }));
}

}  // namespace

const char* to_string(Severity severity) {
  switch (severity) {
    case Severity::kNote:
      return "note";
    case Severity::kWarning:
      return "warning";
    case Severity::kError:
      return "error";
  }
  return "error";
}

void Diagnostics::add(Diagnostic diagnostic) {
  if (diagnostic.severity == Severity::kError) ++error_count_;
  if (diagnostic.severity == Severity::kWarning) ++warning_count_;
  if (list_.size() < kMaxDiagnostics) list_.push_back(std::move(diagnostic));
}

void Diagnostics::add(Severity severity, std::string code, const SourceText& source, Span span,
                      std::string message, std::string hint) {
  std::string line(source.line(span.line));
  LineOrigin origin = source.origin(span.line);
  span.line = origin.line;
  add({std::move(code), severity, std::move(origin.path), span, std::move(message), std::move(hint),
       std::move(line), std::move(origin.included_from)});
}

void Diagnostics::error(std::string code, const SourceText& source, Span span, std::string message,
                        std::string hint) {
  add(Severity::kError, std::move(code), source, span, std::move(message), std::move(hint));
}

void Diagnostics::unreadable(const std::string& path, const std::string& reason) {
  Diagnostic diagnostic;
  diagnostic.code = "FILE-UNREADABLE";
  diagnostic.file = path;
  diagnostic.message = fmt::format("the file cannot be read: {}", reason);
  add(std::move(diagnostic));
}

void Diagnostics::warning(std::string code, const SourceText& source, Span span,
                          std::string message, std::string hint) {
  add(Severity::kWarning, std::move(code), source, span, std::move(message), std::move(hint));
}

void Diagnostics::sort() {
  std::stable_sort(list_.begin(), list_.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return std::tie(a.file, a.span.line, a.span.column) <
           std::tie(b.file, b.span.line, b.span.column);
  });
}

std::string render(const Diagnostic& diagnostic, bool color) {
  const char* bold = color ? "\033[1m" : "";
  const char* tint = !color                                      ? ""
                     : diagnostic.severity == Severity::kError   ? "\033[1;31m"
                     : diagnostic.severity == Severity::kWarning ? "\033[1;33m"
                                                                 : "\033[1;36m";
  const char* reset = color ? "\033[0m" : "";

  std::string place = printable(diagnostic.file);
  if (diagnostic.span.line > 0) place += fmt::format(":{}", diagnostic.span.line);
  if (diagnostic.span.column > 0) place += fmt::format(":{}", diagnostic.span.column);
  std::string text = fmt::format("{}{}:{} {}{}:{} {} [{}]\n", bold, place, reset, tint,
                                 to_string(diagnostic.severity), reset,
                                 printable(diagnostic.message), diagnostic.code);

  if (!diagnostic.source_line.empty() && diagnostic.span.column > 0) {
    std::string shown = printable(diagnostic.source_line);
    std::size_t caret =
        std::min(static_cast<std::size_t>(diagnostic.span.column - 1), shown.size());
    std::size_t length = std::min(static_cast<std::size_t>(std::max(diagnostic.span.length, 1)),
                                  std::max<std::size_t>(shown.size() - caret, 1));
    if (shown.size() > kMaxShownLine) {
      std::size_t begin = caret > kContextBeforeCaret ? caret - kContextBeforeCaret : 0;
      while (begin > 0 && is_continuation(shown[begin])) --begin;
      std::size_t end = std::min(begin + kMaxShownLine, shown.size());
      while (end < shown.size() && is_continuation(shown[end])) ++end;
      shown = shown.substr(begin, end - begin);
      caret -= begin;
      length = std::min(length, std::max<std::size_t>(shown.size() - caret, 1));
    }
    const std::size_t indent = display_width(std::string_view(shown).substr(0, caret));
    const std::size_t marks =
        std::max<std::size_t>(display_width(std::string_view(shown).substr(caret, length)), 1);
    text += fmt::format("  {}\n  {}{}^{}{}\n", shown, std::string(indent, ' '), tint,
                        std::string(marks - 1, '~'), reset);
  }
  if (!diagnostic.included_from.empty()) {
    text += fmt::format("  included from {}\n", printable(diagnostic.included_from));
  }
  if (!diagnostic.hint.empty()) text += fmt::format("  hint: {}\n", printable(diagnostic.hint));
  return text;
}

}  // namespace dive
