#include "mission/import/import_report.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace dive::mission {
namespace {

std::string lines_in_words(const std::vector<int>& lines) {
  return fmt::format("{} {}", lines.size() == 1 ? "line" : "lines", fmt::join(lines, ", "));
}

}  // namespace

void ImportReport::find(Severity severity, std::string code, Span span, std::string message,
                        std::string detail, std::string hint) {
  if (severity == Severity::kError) has_error_ = true;
  const auto same = [&](const Finding& finding) {
    return finding.severity == severity && finding.code == code && finding.message == message;
  };
  const auto at = std::ranges::find_if(findings_, same);
  if (at != findings_.end()) {
    at->places.push_back({span, std::move(detail)});
    return;
  }
  findings_.push_back({severity,
                       std::move(code),
                       std::move(message),
                       std::move(hint),
                       {{span, std::move(detail)}}});
}

void ImportReport::note(std::string code, Span span, std::string message, std::string detail) {
  find(Severity::kNote, std::move(code), span, std::move(message), std::move(detail), {});
}

void ImportReport::warning(std::string code, Span span, std::string message, std::string detail,
                           std::string hint) {
  find(Severity::kWarning, std::move(code), span, std::move(message), std::move(detail),
       std::move(hint));
}

void ImportReport::error(std::string code, Span span, std::string message, std::string hint) {
  find(Severity::kError, std::move(code), span, std::move(message), {}, std::move(hint));
}

void ImportReport::add(const Diagnostics& found) {
  if (!found.ok()) has_error_ = true;
  others_.insert(others_.end(), found.list().begin(), found.list().end());
}

std::string ImportReport::text_of(const Finding& finding) {
  std::vector<std::pair<std::string, std::vector<int>>> details;  // in the order of the file
  for (const Place& place : finding.places) {
    auto at =
        std::ranges::find(details, place.detail, &std::pair<std::string, std::vector<int>>::first);
    if (at == details.end()) {
      details.emplace_back(place.detail, std::vector<int>{});
      at = std::prev(details.end());
    }
    std::vector<int>& lines = at->second;
    if (lines.empty() || lines.back() != place.span.line) lines.push_back(place.span.line);
  }
  const int first = finding.places.front().span.line;
  const bool is_spread = std::ranges::any_of(
      finding.places, [first](const Place& place) { return place.span.line != first; });
  std::string text = finding.message;
  const char* separator = ": ";
  for (const auto& [detail, lines] : details) {
    if (!detail.empty()) text += separator + detail;
    if (is_spread) text += fmt::format(" ({})", lines_in_words(lines));
    separator = ", ";
  }
  return text;
}

Diagnostics ImportReport::diagnostics() const {
  Diagnostics diagnostics;
  for (const Diagnostic& other : others_) diagnostics.add(other);
  for (const Finding& finding : findings_) {
    const Span& span = finding.places.front().span;
    diagnostics.add({finding.code, finding.severity, source_.path(), span, text_of(finding),
                     finding.hint, std::string(source_.line(span.line))});
  }
  diagnostics.sort();
  return diagnostics;
}

}  // namespace dive::mission
