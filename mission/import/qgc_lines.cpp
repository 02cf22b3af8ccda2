#include <algorithm>
#include <array>
#include <sstream>
#include <string>

#include <fmt/format.h>

#include "mission/import/qgc_items.h"

namespace dive::mission {
namespace {

constexpr std::size_t kColumns = 12;

// "INDEX CURRENT FRAME COMMAND P1 P2 P3 P4 LATITUDE LONGITUDE ALTITUDE AUTOCONTINUE"
QgcItem item_of_line(const std::array<double, kColumns>& value, Span span) {
  QgcItem item{static_cast<int>(value[2]), static_cast<int>(value[3]), {}, true, span};
  for (std::size_t i = 0; i < 7; ++i) item.parameters[i] = value[4 + i];
  item.goes_on = value[11] != 0.0;
  return item;
}

}  // namespace

QgcPlan read_qgc_lines(ImportReport& report) {
  QgcPlan plan;
  plan.yaw_zero_is_open = true;  // the format has no other representation of no yaw
  const SourceText& source = report.source();
  for (int number = 2; number <= source.line_count(); ++number) {
    std::istringstream line{std::string(source.line(number))};
    const Span span{number, 1, std::max(static_cast<int>(source.line(number).size()), 1)};
    std::array<double, kColumns> value{};
    std::size_t read = 0;
    while (read < value.size() && line >> value[read]) ++read;
    if (read == 0 && source.line(number).find_first_not_of(" \t\r") == std::string_view::npos) {
      continue;
    }
    if (read < value.size()) {
      report.error("IMP-QGC", span,
                   fmt::format("a waypoint has 12 numbers, this line has {}", read));
      continue;
    }
    if (std::string rest; line >> rest) {
      report.warning("IMP-UNKNOWN", span,
                     fmt::format("'{}' after the 12 numbers of a waypoint is not understood and "
                                 "left out",
                                 rest));
    }
    const bool is_home = plan.items.empty() && value[0] == 0.0;
    if (is_home) {
      report.note("IMP-LEFT-OUT", span,
                  fmt::format("home, at latitude {} and longitude {}, {} m high, is left out: the "
                              "vehicle starts at the first waypoint",
                              value[8], value[9], value[10]));
      continue;
    }
    if (!is_whole(value[2]) || !is_whole(value[3])) {
      report.error("IMP-QGC", span, kNotWhole);
      continue;
    }
    plan.items.push_back(item_of_line(value, span));
    if (plan.items.size() > kMaxQgcItems) {
      report.error("IMP-QGC", span, fmt::format("there are more than {} items", kMaxQgcItems));
      break;
    }
  }
  return plan;
}

}  // namespace dive::mission
