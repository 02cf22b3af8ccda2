#pragma once
// Typed values, with their positions, of the attributes of elements that have passed the schema.
// Private to mission/document.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/xml.h"
#include "mission/document/mission.h"

namespace dive::mission {

class AttributeReader {
 public:
  /// `source` must outlive the reader.
  explicit AttributeReader(const SourceText& source) : source_(source) {}

  [[nodiscard]] const SourceText& source() const { return source_; }

  // Values of attributes that the schema requires or gives a default.
  [[nodiscard]] Located<double> number(const XmlElement& element, std::string_view attribute) const;
  [[nodiscard]] Located<std::string> name(const XmlElement& element,
                                          std::string_view attribute) const;
  [[nodiscard]] bool flag(const XmlElement& element, std::string_view attribute) const;
  /// Blanks are allowed inside a path, not around it.
  [[nodiscard]] Located<std::string> path(const XmlElement& element,
                                          std::string_view attribute) const;
  /// The value as written.
  [[nodiscard]] Located<std::string> text(const XmlElement& element,
                                          std::string_view attribute) const;

  [[nodiscard]] std::optional<Located<double>> optional_number(const XmlElement& element,
                                                               std::string_view attribute) const;
  /// The words of the value, each with its position.
  [[nodiscard]] std::vector<Located<std::string>> words(const XmlAttribute& attribute) const;

  [[nodiscard]] Position position(const XmlElement& element) const;
  [[nodiscard]] ZUnits z_units(const XmlElement& element) const;
  [[nodiscard]] ReplanPolicy replan(const XmlElement& element) const;

 private:
  [[nodiscard]] static const XmlAttribute& required(const XmlElement& element,
                                                    std::string_view attribute);

  const SourceText& source_;
};

}  // namespace dive::mission
