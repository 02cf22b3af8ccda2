#include "mission/document/current_table.h"

#include <utility>

#include <fmt/format.h>

#include "common/declared_current.h"
#include "common/source_text.h"
#include "mission/document/file_beneath.h"
#include "mission/document/source_place.h"

namespace dive::mission {
namespace {

constexpr std::string_view kHeader = "time,speed,towards_deg";
constexpr std::size_t kColumns = 3;
constexpr int kMaxHours = 48;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpaces = " \t";
  const std::size_t begin = text.find_first_not_of(kSpaces);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpaces) - begin + 1);
}

// A number from 0 to `most` without an exponent, as an attribute of the mission may hold it.
bool is_number(std::string_view text, double most) {
  const auto value = parse_number(text);
  return value && *value >= 0.0 && *value <= most &&
         text.find_first_not_of("0123456789.") == std::string_view::npos;
}

class TableReader {
 public:
  TableReader(const SourceText& table, const std::string& included_from, Diagnostics& diagnostics)
      : table_(table), included_from_(included_from), diagnostics_(diagnostics) {}

  std::vector<CurrentTableRow> read() {
    const std::size_t errors_before = diagnostics_.error_count();
    for (int line = 1; line <= table_.line_count(); ++line) {
      std::string_view text = table_.line(line);
      if (line == 1 && text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
      if (trimmed(text).empty() || trimmed(text).front() == '#') continue;
      if (!std::exchange(has_header_, true)) {
        if (!is_header(line, text)) return {};
      } else if (rows_.size() == DeclaredCurrent::kMaxSamples) {
        error(line, text,
              fmt::format("the table has more than {} rows", DeclaredCurrent::kMaxSamples),
              "leave out rows: values between them are interpolated");
        return {};
      } else {
        add_row(line, text);
      }
    }
    const bool is_complete = diagnostics_.error_count() == errors_before;
    if (is_complete && rows_.size() < 2) {
      error(table_.line_count(), {},
            fmt::format("the table has {} row{} of values: two or more are needed", rows_.size(),
                        rows_.size() == 1 ? "" : "s"),
            "write speed=\"...\" and towards_deg=\"...\" in the mission for a constant current");
    }
    return diagnostics_.error_count() == errors_before ? std::move(rows_)
                                                       : std::vector<CurrentTableRow>{};
  }

 private:
  bool is_header(int line, std::string_view text) {
    const std::vector<std::string_view> names = columns(text);
    const bool is_right = names == std::vector<std::string_view>{"time", "speed", "towards_deg"};
    if (!is_right) {
      error(line, text, fmt::format("the first line must name the columns: {}", kHeader),
            "separate columns by commas, and write decimals with a point");
    }
    return is_right;
  }

  static std::vector<std::string_view> columns(std::string_view text) {
    std::vector<std::string_view> result;
    for (std::size_t begin = 0;;) {
      const std::size_t comma = text.find(',', begin);
      result.push_back(trimmed(text.substr(begin, comma - begin)));
      if (comma == std::string_view::npos) return result;
      begin = comma + 1;
    }
  }

  void add_row(int line, std::string_view text) {
    const std::vector<std::string_view> values = columns(text);
    if (values.size() != kColumns) {
      error(line, text,
            fmt::format("the line has {} value{}: three are expected, {}", values.size(),
                        values.size() == 1 ? "" : "s", kHeader),
            "separate columns by commas, and write decimals with a point");
      return;
    }
    const int minutes = minutes_of_day(values[0]);
    if (minutes < 0) {
      error(line, values[0], fmt::format("'{}' is not a time of day", values[0]),
            "write HH:MM, with hours from 00 to 47; from 24 on they belong to the next day");
      return;
    }
    if (!rows_.empty() && minutes <= last_minutes_) {
      error(
          line, values[0],
          fmt::format("'{}' is not later than the row before, '{}'", values[0], rows_.back().time),
          "sort the rows by time; past midnight write 24:00, 24:30, ...");
    }
    if (!is_number(values[1], DeclaredCurrent::kMaxSpeed)) {
      error(line, values[1], fmt::format("'{}' is not a speed", values[1]),
            fmt::format("write a number from 0 to {:g} (m/s)", DeclaredCurrent::kMaxSpeed));
    }
    if (!is_number(values[2], 360.0)) {
      error(line, values[2], fmt::format("'{}' is not a compass heading", values[2]),
            "write a number from 0 to 360 (degrees, 90 is east)");
    }
    last_minutes_ = minutes;
    rows_.push_back({line, std::string(values[0]), std::string(values[1]), std::string(values[2])});
  }

  // `at` is a part of that line.
  void error(int line, std::string_view at, std::string message, std::string hint) {
    const std::string_view whole = table_.line(line);
    const int column = at.data() == nullptr ? 1 : static_cast<int>(at.data() - whole.data()) + 1;
    diagnostics_.add({kCurrentTableCode, Severity::kError, table_.path(),
                      Span{line, column, static_cast<int>(at.size())}, std::move(message),
                      std::move(hint), std::string(whole), included_from_});
  }

  const SourceText& table_;
  const std::string& included_from_;
  Diagnostics& diagnostics_;
  bool has_header_ = false;
  int last_minutes_ = 0;
  std::vector<CurrentTableRow> rows_;
};

}  // namespace

int minutes_of_day(std::string_view time) {
  const auto digit = [&](std::size_t i) {
    return time[i] >= '0' && time[i] <= '9' ? time[i] - '0' : -1000;
  };
  if (time.size() != 5 || time[2] != ':') return -1;
  const int hours = 10 * digit(0) + digit(1);
  const int minutes = 10 * digit(3) + digit(4);
  const bool is_time = hours >= 0 && hours < kMaxHours && minutes >= 0 && minutes < 60;
  return is_time ? 60 * hours + minutes : -1;
}

CurrentTable load_current_table(const Scope& scope, const XmlElement& current, bool may_read,
                                const CurrentTableFolder& folder, Diagnostics& diagnostics) {
  const XmlAttribute& table = *current.attribute("table");
  CurrentTable result;
  result.included_from = fmt::format("{}:{}", scope.source->path(), table.name_span.line);
  const auto refuse = [&](const Span& span, std::string message, std::string hint) {
    add_error(diagnostics, scope, kCurrentTableCode, span, std::move(message), std::move(hint));
    return result;
  };
  const ElementExtent extent = extent_of(*scope.source, current);
  if (extent.content != extent.end) {
    return refuse(current.span, "a current with a table has no content",
                  "end its tag with '/>', or leave 'table' out");
  }
  if (!may_read) {
    return refuse(table.name_span, "here no table can be read: the text has no folder", {});
  }
  if (table.value.find(kParameterOpening) != std::string::npos) {
    return refuse(table.value_span, "the file of a table cannot depend on a parameter",
                  "write the path of the table");
  }
  const auto path = file_beneath(folder.root, folder.from, table.value, "table");
  if (!path) return refuse(table.value_span, path.error().reason, path.error().hint);
  result.path = (std::filesystem::path(folder.mission_path).parent_path() /
                 path->lexically_relative(folder.root))
                    .string();
  const auto file = read_source_text(result.path, kMaxCurrentTableBytes);
  if (!file) {
    return refuse(table.value_span, fmt::format("the table '{}' {}", table.value, file.error()),
                  fmt::format("write a CSV file with the columns {}", kHeader));
  }
  result.rows = read_current_table(*file, result.included_from, diagnostics);
  return result;
}

std::vector<CurrentTableRow> read_current_table(const SourceText& table,
                                                const std::string& included_from,
                                                Diagnostics& diagnostics) {
  return TableReader(table, included_from, diagnostics).read();
}

}  // namespace dive::mission
