#pragma once
// Reads the elements of an ACFR mission. Every element and attribute that is read is accounted for,
// so that the rest can be reported; what is missing or wrong is an error of the report.

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "common/xml.h"
#include "mission/import/foreign_mission.h"
#include "mission/import/xml_account.h"

namespace dive::mission {

[[nodiscard]] std::string lower_case(std::string text);

class AcfrElements {
 public:
  /// `report` must live longer.
  explicit AcfrElements(ImportReport& report) : report_(report) {}

  [[nodiscard]] XmlAccount& account() { return account_; }
  [[nodiscard]] ImportReport& report() { return report_; }

  void error(Span span, std::string message, std::string hint = {});
  /// Notes that the element is understood and has no equivalent.
  void leave_out(const XmlElement& element, const std::string& why);

  /// The number in the first of these attributes that the element has. Having none is an error.
  [[nodiscard]] std::optional<double> number(const XmlElement& element,
                                             std::initializer_list<std::string_view> names);
  /// Value of a required part of the primitive.
  [[nodiscard]] std::optional<double> part(const XmlElement& primitive, std::string_view name,
                                           std::initializer_list<std::string_view> attributes);
  /// Degrees from north. Empty, without an error, if the primitive has none.
  [[nodiscard]] std::optional<double> heading_of(const XmlElement& primitive);

 private:
  [[nodiscard]] std::optional<double> number_in(const XmlAttribute& attribute);

  ImportReport& report_;
  XmlAccount account_;
};

}  // namespace dive::mission
