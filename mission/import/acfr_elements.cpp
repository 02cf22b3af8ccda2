#include "mission/import/acfr_elements.h"

#include <cctype>
#include <utility>

#include <fmt/format.h>

#include "common/se3.h"

namespace dive::mission {

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

void AcfrElements::error(Span span, std::string message, std::string hint) {
  report_.error("IMP-ACFR", span, std::move(message), std::move(hint));
}

void AcfrElements::leave_out(const XmlElement& element, const std::string& why) {
  account_.take(element);
  for (const XmlAttribute& attribute : element.attributes) {
    account_.attribute(element, attribute.name);
  }
  report_.note("IMP-LEFT-OUT", element.span,
               fmt::format("{} is left out: {}", in_words(element), why));
}

std::optional<double> AcfrElements::number_in(const XmlAttribute& attribute) {
  const std::optional<double> value = parse_number(attribute.value);
  if (!value) error(attribute.value_span, fmt::format("'{}' is not a number", attribute.value));
  return value;
}

std::optional<double> AcfrElements::number(const XmlElement& element,
                                           std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    if (const XmlAttribute* attribute = account_.attribute(element, name)) {
      return number_in(*attribute);
    }
  }
  error(element.span, fmt::format("'{}' lacks the attribute '{}'", element.name, *names.begin()));
  return std::nullopt;
}

std::optional<double> AcfrElements::part(const XmlElement& primitive, std::string_view name,
                                         std::initializer_list<std::string_view> attributes) {
  const XmlElement* child = account_.child(primitive, name);
  if (child != nullptr) return number(*child, attributes);
  error(primitive.span, fmt::format("'{}' lacks a '{}'", primitive.name, name));
  return std::nullopt;
}

std::optional<double> AcfrElements::heading_of(const XmlElement& primitive) {
  const XmlElement* element = account_.child(primitive, "heading");
  if (element == nullptr) element = account_.child(primitive, "rotation");
  if (element == nullptr) return std::nullopt;
  if (element->attribute("deg") == nullptr && element->attribute("rad") != nullptr) {
    const auto angle = number(*element, {"rad"});
    return angle ? std::optional(rad_to_deg(*angle)) : std::nullopt;
  }
  if (element->attribute("deg") == nullptr && element->attribute("r") != nullptr) {
    report_.warning("IMP-CHANGED", element->span,
                    fmt::format("{} is taken to be in degrees", in_words(*element)));
  }
  return number(*element, {"deg", "r"});
}

}  // namespace dive::mission
