#include "mission/document/geographic.h"

#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "common/assert.h"

namespace dive::mission {
namespace {

// Before the names of the coordinates: an element has one position, or the two ends of a line.
constexpr std::array<std::string_view, 3> kPrefixes{"", "from_", "to_"};
constexpr std::array<std::string_view, 2> kHeadings{"heading_deg", "first_bearing_deg"};

double number(const XmlAttribute& attribute) {
  const std::optional<double> value = parse_number(attribute.value);
  DIVE_DEMAND(value);  // every xs:decimal is a valid double
  return *value;
}

XmlAttribute* find(XmlElement& element, std::string_view name) {
  for (XmlAttribute& attribute : element.attributes) {
    if (attribute.name == name) return &attribute;
  }
  return nullptr;
}

class Resolver {
 public:
  Resolver(const SourceText& source, const Language& language, Diagnostics& diagnostics)
      : source_(source), language_(language), diagnostics_(diagnostics) {}

  std::optional<Origin> resolve(XmlElement& mission) {
    if (const XmlElement* element = mission.child("origin")) read_origin(*element);
    visit(mission, language_.type("", mission.name));
    return origin_;
  }

 private:
  void read_origin(const XmlElement& element) {
    origin_ =
        Origin{{number(*element.attribute("latitude")), number(*element.attribute("longitude"))},
               std::nullopt,
               element.span};
    if (const XmlAttribute* declination = element.attribute("declination_deg")) {
      origin_->declination_deg = number(*declination);
    }
    const XmlAttribute* headings = element.attribute("headings");
    DIVE_DEMAND(headings != nullptr);  // it has a default
    if (headings->value != "magnetic") return;
    if (origin_->declination_deg) {
      turn_deg_ = *origin_->declination_deg;
      return;
    }
    error("MIS-ORIGIN", headings->value_span,
          "headings are magnetic, but the declination is not stated",
          "write declination_deg=\"...\" at <origin>: positive where a compass points east of true "
          "north");
  }

  void visit(XmlElement& element, const std::string& type) {
    const ElementRule& rule = language_.type_rule(type);
    for (const std::string_view prefix : kPrefixes) {
      const auto has = [&](const char* name) {
        return rule.attribute(fmt::format("{}{}", prefix, name)) != nullptr;
      };
      if (has("x") && has("latitude")) position(element, prefix);
    }
    if (turn_deg_ != 0.0) {
      for (const std::string_view name : kHeadings) turn(element, name);
    }
    for (XmlElement& child : element.children) {
      // An element of text alone, such as the description, is of a simple type.
      const std::string child_type = language_.type(type, child.name);
      if (language_.rule(type, child.name) != nullptr) visit(child, child_type);
    }
  }

  void position(XmlElement& element, std::string_view prefix) {
    const auto name = [&](const char* coordinate) {
      return fmt::format("{}{}", prefix, coordinate);
    };
    const XmlAttribute* x = find(element, name("x"));
    const XmlAttribute* y = find(element, name("y"));
    const XmlAttribute* latitude = find(element, name("latitude"));
    const XmlAttribute* longitude = find(element, name("longitude"));
    if ((x != nullptr || y != nullptr) && (latitude != nullptr || longitude != nullptr)) {
      const XmlAttribute& second = latitude != nullptr ? *latitude : *longitude;
      error("MIS-POSITION", second.name_span,
            fmt::format("'{}' has its position twice, by '{}' and by '{}'", element.name,
                        x != nullptr ? x->name : y->name, second.name),
            fmt::format("write either {} and {}, or {} and {}", name("x"), name("y"),
                        name("latitude"), name("longitude")));
      return complete(element, prefix);
    }
    if (x != nullptr && y != nullptr) return;
    if (latitude == nullptr || longitude == nullptr) {
      const char* missing = x != nullptr           ? "y"
                            : y != nullptr         ? "x"
                            : latitude != nullptr  ? "longitude"
                            : longitude != nullptr ? "latitude"
                                                   : nullptr;
      error("MIS-POSITION", element.span,
            missing != nullptr ? fmt::format("'{}' lacks '{}'", element.name, name(missing))
                               : fmt::format("'{}' lacks a position", element.name),
            fmt::format("write {} and {} (m), or {} and {} (degrees)", name("x"), name("y"),
                        name("latitude"), name("longitude")));
      return complete(element, prefix);
    }
    project(element, prefix, *latitude, *longitude);
  }

  // By value: attributes are added.
  void project(XmlElement& element, std::string_view prefix, XmlAttribute latitude,
               XmlAttribute longitude) {
    if (!origin_) {
      error(
          "MIS-ORIGIN", latitude.name_span,
          "a position by latitude and longitude requires the origin of x and y",
          fmt::format("add <origin latitude=\"{}\" longitude=\"{}\"/>, or another place nearby, to "
                      "the mission",
                      latitude.value, longitude.value));
      return complete(element, prefix);
    }
    const auto p = to_plane(origin_->place, {number(latitude), number(longitude)});
    if (!p) {
      error("MIS-POSITION", latitude.value_span,
            fmt::format("the position is more than {:g} km from the origin ({})",
                        kMaxOriginDistance / 1000.0, source_.line_name(origin_->span.line)),
            "check signs and digits: north and east are positive");
      return complete(element, prefix);
    }
    add(element, fmt::format("{}x", prefix), fmt::format("{:.6f}", p->x()), longitude);
    add(element, fmt::format("{}y", prefix), fmt::format("{:.6f}", p->y()), latitude);
  }

  static void add(XmlElement& element, std::string name, std::string value,
                  const XmlAttribute& written) {
    element.attributes.push_back(
        {std::move(name), {}, std::move(value), written.name_span, written.value_span});
  }

  // After an error, so that the other mistakes of the mission can be found.
  static void complete(XmlElement& element, std::string_view prefix) {
    const XmlAttribute nowhere{{}, {}, {}, element.span, element.span};
    for (const char* coordinate : {"x", "y"}) {
      const std::string name = fmt::format("{}{}", prefix, coordinate);
      if (element.attribute(name) == nullptr) add(element, name, "0", nowhere);
    }
  }

  void turn(XmlElement& element, std::string_view name) const {
    XmlAttribute* heading = find(element, name);
    if (heading == nullptr) return;
    const double turned = std::fmod(number(*heading) + turn_deg_ + 360.0, 360.0);
    heading->value = fmt::format("{:.9f}", turned);
  }

  void error(const char* code, Span span, std::string message, std::string hint) {
    diagnostics_.error(code, source_, span, std::move(message), std::move(hint));
  }

  const SourceText& source_;
  const Language& language_;
  Diagnostics& diagnostics_;
  std::optional<Origin> origin_;
  double turn_deg_ = 0.0;  // From a heading as written to a true one.
};

}  // namespace

std::optional<Origin> resolve_positions(XmlElement& mission, const SourceText& source,
                                        const Language& language, Diagnostics& diagnostics) {
  return Resolver(source, language, diagnostics).resolve(mission);
}

}  // namespace dive::mission
