#pragma once
// Pages in HTML: texts in them, and what is inserted.

#include <functional>
#include <string>
#include <string_view>

namespace dive::mission {

/// The text as it stands in an element or an attribute: nothing in it is markup. Bytes that are not
/// UTF-8 are replaced.
[[nodiscard]] std::string escaped_html(std::string_view text);

/// The page with each `<!--insert NAME-->` replaced by `text_for(NAME)`, which is not escaped.
[[nodiscard]] std::string filled_page(
    std::string_view page, const std::function<std::string(std::string_view name)>& text_for);

}  // namespace dive::mission
