#pragma once
// Dives and their reports, by the commands.

#include <functional>
#include <string>

#include <nlohmann/json.hpp>

#include "mission/record/log.h"

namespace dive::mission::testing {

struct ReportedDive {
  nlohmann::json run;  ///< What `dive run --json` printed.
  std::string folder;
  std::string log;   ///< Path.
  std::string page;  ///< Content of the report.
  std::string page_path;
};

/// `dive run ARGUMENTS` in the folder of the present test, and the report of its log.
[[nodiscard]] ReportedDive dive_and_report(const std::string& arguments);

/// The folder of the present test.
[[nodiscard]] std::string folder_of_test();

/// Writes `to`: the log `from` after `change`, tick by tick.
void rewrite_log(const std::string& from, const std::string& to,
                 const std::function<void(LogHeader&)>& change_header,
                 const std::function<void(LoggedTick&)>& change);

}  // namespace dive::mission::testing
