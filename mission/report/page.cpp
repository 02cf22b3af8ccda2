#include "mission/report/page.h"

#include <string_view>

#include <nlohmann/json.hpp>

#include "common/assert.h"
#include "mission/report/html.h"
#include "mission/report/page_data.h"

namespace dive::mission {

// Embedded from mission/report/page/ and from Debian's packages: CMakeLists.txt.
extern const char kReportPage[];
extern const char kReportStyle[];
extern const char kReportScript[];
extern const char kReportLibraries[];
extern const char kReportLicences[];

namespace {

// JSON that can stand in a script element: without '<' it can neither end the element nor begin a
// comment. Bytes that are not UTF-8 are replaced.
std::string json_for_script(const nlohmann::ordered_json& json) {
  const std::string text =
      json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      escaped += "\\u003c";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string script(std::string_view code) {
  std::string element = "<script>\n";
  element += code;
  element += "\n</script>\n";
  return element;
}

std::string text_for(std::string_view name, const Report& report) {
  if (name == "title") {
    // The title is the only text of the report outside of its JSON.
    return escaped_html(report.title);
  }
  if (name == "style") return std::string("<style>\n") + kReportStyle + "</style>";
  if (name == "data") {
    return "<script type=\"application/json\" id=\"report-data\">" +
           json_for_script(page_data(report)) + "</script>";
  }
  if (name == "libraries") {
    return std::string("<script type=\"text/plain\" id=\"licences\">") + kReportLicences +
           "</script>\n" + script(kReportLibraries);
  }
  DIVE_DEMAND(name == "script");
  return script(kReportScript);
}

}  // namespace

std::string render_page(const Report& report) {
  return filled_page(kReportPage, [&](std::string_view name) { return text_for(name, report); });
}

}  // namespace dive::mission
