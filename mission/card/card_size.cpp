#include "mission/card/card_size.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "mission/card/abort_table.h"
#include "mission/card/card_legs.h"
#include "mission/card/checklist.h"

namespace dive::mission {
namespace {

// As in page/card.css.
constexpr double kPageHeight = 283.0;  // mm within the margins of A4
constexpr double kPageWidth = 194.0;
constexpr double kLine = 1.18;        // em
constexpr double kRowPadding = 0.12;  // em
constexpr double kBorder = 0.3;       // mm
constexpr double kShareUsed = 1.0;    // of the page: the widths of letters are estimates
constexpr double kLetter = 0.5;       // em, of a wide sans serif
constexpr double kBoldLetter = 0.56;

/// Lengths in mm of a card with one size of type.
class Measure {
 public:
  explicit Measure(double points) : em_(points * 25.4 / 72.0) {}

  [[nodiscard]] double em(double count) const { return count * em_; }
  [[nodiscard]] double lines(double count) const { return count * kLine * em_; }
  /// Height of a text that wraps at `width`.
  [[nodiscard]] double text(std::size_t bytes, double width, double letter = kLetter) const {
    return lines(std::max(std::ceil(static_cast<double>(bytes) * letter * em_ / width), 1.0));
  }
  /// Height of table rows of one line each.
  [[nodiscard]] double rows(std::size_t count) const {
    return static_cast<double>(count) * row(lines(1.0));
  }
  [[nodiscard]] double row(double content) const { return content + em(kRowPadding) + kBorder; }

 private:
  double em_;
};

double header(const CardSource& source, const Measure& measure) {
  constexpr double kWidth = 0.6 * kPageWidth;  // beside the blanks
  const std::size_t id = std::min(source.mission.id.size(), kMaxNameBytes);
  const std::size_t description = std::min(source.mission.description.size(), kMaxDescriptionBytes);
  const double left =
      measure.text(2 * id, kWidth, 0.8) * 2.0 / kLine + measure.text(description, kWidth, 0.7);
  return std::max(left, measure.em(3.5)) + measure.em(0.3) + 3.0 * kBorder;
}

double warnings(const CardSource& source, const Measure& measure) {
  double height = 0.0;
  std::size_t count = 0;
  for (const Diagnostic& diagnostic : source.diagnostics.list()) {
    if (diagnostic.severity != Severity::kWarning || ++count > kMaxCardWarnings) continue;
    const std::size_t bytes = std::min(diagnostic.message.size(), kMaxWarningBytes);
    height += measure.text(diagnostic.code.size() + bytes, 0.95 * kPageWidth);
  }
  if (count > kMaxCardWarnings) height += measure.lines(1.0);
  return count == 0 ? 0.0 : height + measure.em(0.7) + 4.0 * kBorder;
}

double abort_rows(const CardSource& source, const Measure& measure) {
  constexpr double kFaultWidth = 0.45 * kPageWidth;  // the narrower case, with overheads
  constexpr double kActionWidth = 0.26 * kPageWidth;
  double height = measure.lines(2.0);  // head
  for (const AbortRow& row : abort_table(source.mission)) {
    const std::size_t bytes = fmt::format("{}", fmt::join(row.faults, "; ")).size();
    height +=
        measure.row(std::max(measure.text(bytes, kFaultWidth),
                             measure.text(row.under_overhead.size(), kActionWidth, kBoldLetter)));
  }
  return height;
}

double tick_rows(const CardSource& source, const Measure& measure) {
  constexpr double kWidth = 0.44 * kPageWidth;  // two columns
  const std::vector<std::string> lines = checklist(source.mission, source.report);
  double height = 0.0;
  for (std::size_t i = 0; i < lines.size(); i += 2) {
    const std::size_t other = i + 1 < lines.size() ? lines[i + 1].size() : 0;
    height += measure.text(std::max(lines[i].size(), other), kWidth) + measure.em(0.12);
  }
  return height;
}

double height_of(const CardSource& source, const Measure& measure) {
  constexpr double kHeadings = 5.0;
  constexpr std::size_t kNoteBytes = 230;  // below the legs
  constexpr std::size_t kDivesBytes = 340;
  const std::size_t states = state_reactions(source.mission, source.report).size();
  double height = header(source, measure) + warnings(source, measure);
  height += kHeadings * (1.08 * measure.lines(1.0) + measure.em(0.4) + 2.0 * kBorder);
  height += 2.0 * measure.row(measure.lines(1.25));  // limits
  height += measure.rows(card_legs(source.report).size() + 1);
  height += measure.text(kNoteBytes, kPageWidth) + measure.text(kDivesBytes, kPageWidth);
  height += abort_rows(source, measure) + tick_rows(source, measure);
  height += measure.rows(std::min(states, kMaxReactionRows + 1) + 1);
  return height + measure.lines(0.82 * 4.0) + measure.em(0.5) + 3.0 * kBorder;  // files
}

}  // namespace

double type_size(const CardSource& source) {
  constexpr double kMin = 8.0;
  constexpr double kMax = 12.0;
  constexpr double kStep = 0.1;
  double points = kMax;
  while (points > kMin && height_of(source, Measure(points)) > kShareUsed * kPageHeight) {
    points -= kStep;
  }
  return std::max(points, kMin);
}

}  // namespace dive::mission
