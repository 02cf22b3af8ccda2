#include "mission/document/attribute_reader.h"

#include <utility>

#include "common/assert.h"
#include "mission/document/source_place.h"

namespace dive::mission {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

}  // namespace

const XmlAttribute& AttributeReader::required(const XmlElement& element,
                                              std::string_view attribute) {
  const XmlAttribute* found = element.attribute(attribute);
  DIVE_DEMAND(found != nullptr);  // the schema requires it or gives a default
  return *found;
}

Located<double> AttributeReader::number(const XmlElement& element,
                                        std::string_view attribute) const {
  const XmlAttribute& written = required(element, attribute);
  const std::optional<double> value = parse_number(written.value);
  DIVE_DEMAND(value);  // every xs:decimal is a valid double
  return {*value, written.value_span};
}

std::optional<Located<double>> AttributeReader::optional_number(const XmlElement& element,
                                                                std::string_view attribute) const {
  if (element.attribute(attribute) == nullptr) return std::nullopt;
  return number(element, attribute);
}

Located<std::string> AttributeReader::name(const XmlElement& element,
                                           std::string_view attribute) const {
  return words(required(element, attribute)).front();
}

bool AttributeReader::flag(const XmlElement& element, std::string_view attribute) const {
  return name(element, attribute).value == "true";
}

Located<std::string> AttributeReader::path(const XmlElement& element,
                                           std::string_view attribute) const {
  const XmlAttribute& written = required(element, attribute);
  const std::size_t begin = written.value.find_first_not_of(kBlanks);
  const std::size_t end = written.value.find_last_not_of(kBlanks) + 1;
  return {written.value.substr(begin, end - begin),
          span_in_value(source_, written, begin, end - begin)};
}

Located<std::string> AttributeReader::text(const XmlElement& element,
                                           std::string_view attribute) const {
  const XmlAttribute& written = required(element, attribute);
  return {written.value, written.value_span};
}

std::vector<Located<std::string>> AttributeReader::words(const XmlAttribute& attribute) const {
  std::vector<Located<std::string>> located;
  const std::string& value = attribute.value;
  for (std::size_t begin = value.find_first_not_of(kBlanks); begin != std::string::npos;) {
    const std::size_t end = std::min(value.find_first_of(kBlanks, begin), value.size());
    located.push_back(
        {value.substr(begin, end - begin), span_in_value(source_, attribute, begin, end - begin)});
    begin = value.find_first_not_of(kBlanks, end);
  }
  return located;
}

ZUnits AttributeReader::z_units(const XmlElement& element) const {
  const std::string units = name(element, "z_units").value;
  if (units == "DEPTH") return ZUnits::kDepth;
  return units == "ALTITUDE" ? ZUnits::kAltitude : ZUnits::kZ;
}

Position AttributeReader::position(const XmlElement& element) const {
  return {number(element, "x"), number(element, "y"), number(element, "z"), z_units(element)};
}

ReplanPolicy AttributeReader::replan(const XmlElement& element) const {
  ReplanPolicy policy;
  policy.period_s = optional_number(element, "period");
  policy.deviation_m = optional_number(element, "deviation");
  policy.clearance_m = optional_number(element, "clearance");
  policy.no_progress_s = optional_number(element, "no_progress");
  policy.map_change = flag(element, "map_change");
  policy.estimator_switch = flag(element, "estimator_switch");
  policy.max_replans = optional_number(element, "max_replans");
  return policy;
}

}  // namespace dive::mission
