#include "mission/report/html.h"

#include <nlohmann/json.hpp>

#include "common/assert.h"
#include "common/xml.h"

namespace dive::mission {
namespace {

std::string valid_utf8(std::string_view text) {
  const nlohmann::ordered_json json = text;
  const std::string valid =
      json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
  return nlohmann::ordered_json::parse(valid).get<std::string>();
}

}  // namespace

std::string escaped_html(std::string_view text) { return escape_xml(valid_utf8(text)); }

std::string filled_page(std::string_view page,
                        const std::function<std::string(std::string_view name)>& text_for) {
  constexpr std::string_view kBegin = "<!--insert ";
  constexpr std::string_view kEnd = "-->";
  std::string filled;
  for (std::size_t at = page.find(kBegin); at != std::string_view::npos; at = page.find(kBegin)) {
    filled += page.substr(0, at);
    page.remove_prefix(at + kBegin.size());
    const std::size_t end = page.find(kEnd);
    DIVE_DEMAND(end != std::string_view::npos);
    filled += text_for(page.substr(0, end));
    page.remove_prefix(end + kEnd.size());
  }
  filled += page;
  return filled;
}

}  // namespace dive::mission
