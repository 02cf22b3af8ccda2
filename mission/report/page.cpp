#include "mission/report/page.h"

#include <string_view>

#include <nlohmann/json.hpp>

#include "common/assert.h"
#include "mission/report/page_data.h"

namespace dive::mission {

// Embedded from mission/report/page/ and from Debian's packages: CMakeLists.txt.
extern const char kReportPage[];
extern const char kReportStyle[];
extern const char kReportScript[];
extern const char kReportLibraries[];
extern const char kReportLicences[];

namespace {

std::string escaped_html(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

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
    const nlohmann::ordered_json title = report.title;
    const std::string valid =
        title.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
    return escaped_html(nlohmann::ordered_json::parse(valid).get<std::string>());
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
  constexpr std::string_view kBegin = "<!--insert ";
  constexpr std::string_view kEnd = "-->";
  std::string page;
  std::string_view rest = kReportPage;
  for (std::size_t at = rest.find(kBegin); at != std::string_view::npos; at = rest.find(kBegin)) {
    page += rest.substr(0, at);
    rest.remove_prefix(at + kBegin.size());
    const std::size_t end = rest.find(kEnd);
    DIVE_DEMAND(end != std::string_view::npos);
    page += text_for(rest.substr(0, end), report);
    rest.remove_prefix(end + kEnd.size());
  }
  page += rest;
  return page;
}

}  // namespace dive::mission
