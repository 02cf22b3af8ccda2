#pragma once
// Tide tables: the current at times of day, as a CSV file beside the mission.
//
//   time,speed,towards_deg
//   06:00,0.05,80
//   07:30,0.12,85
//
// Times are HH:MM, strictly increasing; hours from 24 to 47 belong to the next day. `speed` is in
// m/s, `towards_deg` the compass heading towards which the water flows. Blank lines and lines that
// begin with '#' are skipped.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "common/xml.h"
#include "mission/document/parameters.h"

namespace dive::mission {

inline constexpr const char* kCurrentTableCode = "MIS-CURRENT-TABLE";
inline constexpr std::size_t kMaxCurrentTableBytes = 64U << 10U;

/// One row, checked, each value as it was written and safe in an attribute of XML.
struct CurrentTableRow {
  int line = 0;
  std::string time;
  std::string speed;
  std::string towards_deg;
};

struct CurrentTable {
  std::string path;           ///< For messages.
  std::string included_from;  ///< The place that names the file, FILE:LINE.
  std::vector<CurrentTableRow> rows;
};

/// Where the table of a current is looked for.
struct CurrentTableFolder {
  std::filesystem::path root;  ///< Canonical folder of the mission: the file lies beneath it.
  std::filesystem::path from;  ///< Folder of the file that names the table.
  std::string mission_path;    ///< The mission's path as it was given.
};

/// The table named by the attribute `table` of `current`, an element of the scope's file. Errors
/// (MIS-CURRENT-TABLE): the element has content, no file may be read (`may_read`), the file is not
/// beneath the folder or not readable or too large, and those of read_current_table(). After an
/// error there are no rows.
[[nodiscard]] CurrentTable load_current_table(const Scope& scope, const XmlElement& current,
                                              bool may_read, const CurrentTableFolder& folder,
                                              Diagnostics& diagnostics);

/// The rows of a table: 2 to DeclaredCurrent::kMaxSamples. Every malformed line is an error
/// (MIS-CURRENT-TABLE) with its line; the result is then empty. `included_from` is the place that
/// names the file, FILE:LINE.
[[nodiscard]] std::vector<CurrentTableRow> read_current_table(const SourceText& table,
                                                              const std::string& included_from,
                                                              Diagnostics& diagnostics);

/// Minutes since midnight of "HH:MM" with hours from 00 to 47; negative if it is not such a time.
[[nodiscard]] int minutes_of_day(std::string_view time);

}  // namespace dive::mission
