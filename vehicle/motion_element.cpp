#include "vehicle/motion_element.h"

#include <algorithm>
#include <cstddef>
#include <set>

#include <fmt/format.h>

#include "common/assert.h"
#include "vehicle/urdf_elements.h"

namespace dive::vehicle {
namespace {

const XmlElement* motion_of(const XmlElement& robot) {
  for (const XmlElement& child : robot.children) {
    if (child.name == "motion" && child.namespace_uri.empty()) return &child;
  }
  return nullptr;
}

const MotionCoefficient* find(const std::string& name) {
  for (const MotionCoefficient& c : motion_coefficients()) {
    if (name == c.name) return &c;
  }
  return nullptr;
}

std::size_t offset_of(const SourceText& text, Span span) {
  return static_cast<std::size_t>(text.line(span.line).data() - text.content().data()) +
         static_cast<std::size_t>(span.column) - 1;
}

/// A part of a text.
struct Range {
  std::size_t begin = 0;
  std::size_t end = 0;
};

// From the "<" of the element to its ">", with the blanks before it and its line break.
Range range_of(const SourceText& text, const XmlElement& element) {
  const std::string& content = text.content();
  Range range;
  range.begin = content.rfind('<', offset_of(text, element.span));
  const std::size_t tag_end = content.find('>', range.begin);
  const bool is_empty = content[tag_end - 1] == '/';
  range.end = is_empty ? tag_end : content.find('>', content.find("</motion", tag_end));
  range.end = std::min(range.end, content.size() - 1) + 1;
  while (range.begin > 0 && (content[range.begin - 1] == ' ' || content[range.begin - 1] == '\t')) {
    --range.begin;
  }
  if (range.end < content.size() && content[range.end] == '\n') ++range.end;
  return range;
}

std::string written(const MotionModel& motion, const std::vector<double>& sigmas) {
  std::string text = "  <motion>\n";
  const auto coefficients = motion_coefficients();
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    const MotionCoefficient& c = coefficients[i];
    // fmt's "{}" of a double is the shortest text that parses to the same double.
    text += fmt::format("    <{} value=\"{}\"", c.name, c.value(motion));
    if (i < sigmas.size() && sigmas[i] > 0.0) text += fmt::format(" sigma=\"{:.2g}\"", sigmas[i]);
    text += fmt::format("/>  <!-- {}{}{} -->\n", c.unit, *c.unit == '\0' ? "" : ": ", c.meaning);
  }
  return text + "  </motion>\n";
}

}  // namespace

std::optional<MotionModel> read_motion(const XmlDocument& document, Diagnostics& diagnostics) {
  MotionModel motion;
  const XmlElement* element = motion_of(document.root);
  if (element == nullptr) return motion;
  UrdfElements elements(document.source, diagnostics);
  const std::size_t errors_before = diagnostics.error_count();
  std::vector<std::string> known;
  for (const MotionCoefficient& c : motion_coefficients()) known.emplace_back(c.name);
  elements.check_children(*element, known);
  std::set<std::string> seen;
  for (const XmlElement& child : element->children) {
    const MotionCoefficient* c = child.namespace_uri.empty() ? find(child.name) : nullptr;
    if (c == nullptr) continue;
    if (!seen.insert(child.name).second) {
      elements.error("URDF-DUPLICATE", child.span,
                     fmt::format("<motion> already has a <{}>", child.name));
    }
    const std::size_t errors = diagnostics.error_count();
    const double value = elements.number(child, "value");
    static_cast<void>(elements.number(child, "sigma", 0.0));
    if (diagnostics.error_count() > errors) continue;
    if (!(value >= c->low && value <= c->high)) {
      elements.error("URDF-MOTION", child.attribute("value")->value_span,
                     fmt::format("{} is {}: expected {} to {}{}{}", c->name, value, c->low, c->high,
                                 *c->unit == '\0' ? "" : " ", c->unit),
                     "leave the element out for the Aqua2's value, or fit it: dive fit LOG...");
      continue;
    }
    c->of(motion) = value;
  }
  if (diagnostics.error_count() > errors_before) return std::nullopt;
  return motion;
}

std::optional<std::string> with_motion(const SourceText& urdf, const MotionModel& motion,
                                       const std::vector<double>& sigmas) {
  DIVE_DEMAND(motion.validate().empty());
  const SourceText bare(urdf.path(), without_motion(urdf));
  const std::size_t end = bare.content().rfind("</robot");
  if (end == std::string::npos) return std::nullopt;
  std::string result = bare.content();
  result.insert(end, written(motion, sigmas));
  Diagnostics diagnostics;
  const std::optional<XmlDocument> document =
      parse_xml(SourceText(urdf.path(), result), XmlLimits{}, diagnostics);
  if (!document || !read_motion(*document, diagnostics)) return std::nullopt;
  return result;
}

std::string without_motion(const SourceText& urdf) {
  Diagnostics diagnostics;
  const std::optional<XmlDocument> document = parse_xml(urdf, XmlLimits{}, diagnostics);
  const XmlElement* element = document ? motion_of(document->root) : nullptr;
  if (element == nullptr) return urdf.content();
  const Range range = range_of(document->source, *element);
  std::string result = document->source.content();
  return result.erase(range.begin, range.end - range.begin);
}

}  // namespace dive::vehicle
