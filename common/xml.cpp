#include "common/xml.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <libxml/parser.h>
#include <libxml/tree.h>

namespace dive {
namespace {

// libxml2 gives the line of an element but not its columns. A few rules suffice to scan a
// well-formed document for its tags; the scan and libxml2's tree then agree in document order,
// which build() demands.
struct TagPlace {
  std::size_t name_offset = 0;
  std::size_t name_length = 0;
  struct Attribute {
    std::string_view name;
    std::size_t name_offset = 0;
    std::size_t value_offset = 0;
    std::size_t value_length = 0;
  };
  std::vector<Attribute> attributes;
};

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

class TagScanner {
 public:
  explicit TagScanner(std::string_view text) : text_(text) {}

  // Positions of all start tags; stops early, without harm, where the text is not well formed.
  std::vector<TagPlace> scan() {
    std::vector<TagPlace> places;
    while (at_ < text_.size()) {
      if (text_[at_] != '<') {
        ++at_;
      } else if (starts_with("<!--")) {
        skip_past("-->");
      } else if (starts_with("<![CDATA[")) {
        skip_past("]]>");
      } else if (starts_with("<?")) {
        skip_past("?>");
      } else if (starts_with("<!DOCTYPE")) {
        doctype_offset_ = at_;
        return places;
      } else if (starts_with("</") || starts_with("<!")) {
        skip_past(">");
      } else {
        places.push_back(start_tag());
      }
    }
    return places;
  }

  [[nodiscard]] std::optional<std::size_t> doctype_offset() const { return doctype_offset_; }

 private:
  [[nodiscard]] bool starts_with(std::string_view prefix) const {
    return text_.substr(at_, prefix.size()) == prefix;
  }
  void skip_past(std::string_view end) {
    const std::size_t found = text_.find(end, at_);
    at_ = found == std::string_view::npos ? text_.size() : found + end.size();
  }
  void skip_spaces() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }
  std::size_t name_end() const {
    return std::min(text_.find_first_of(" \t\r\n/>=<", at_), text_.size());
  }

  TagPlace start_tag() {
    TagPlace place;
    place.name_offset = ++at_;
    at_ = name_end();
    place.name_length = at_ - place.name_offset;
    while (at_ < text_.size()) {
      skip_spaces();
      if (at_ >= text_.size() || text_[at_] == '<') return place;
      if (text_[at_] == '>') {
        ++at_;
        return place;
      }
      if (text_[at_] == '/') {
        ++at_;
        continue;
      }
      TagPlace::Attribute attribute;
      attribute.name_offset = at_;
      at_ = name_end();
      attribute.name = text_.substr(attribute.name_offset, at_ - attribute.name_offset);
      skip_spaces();
      if (at_ < text_.size() && text_[at_] == '=') ++at_;
      skip_spaces();
      if (at_ >= text_.size() || (text_[at_] != '"' && text_[at_] != '\'')) return place;
      const char quote = text_[at_];
      attribute.value_offset = ++at_;
      at_ = std::min(text_.find(quote, at_), text_.size());
      attribute.value_length = at_ - attribute.value_offset;
      if (at_ < text_.size()) ++at_;
      place.attributes.push_back(attribute);
    }
    return place;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::optional<std::size_t> doctype_offset_;
};

struct FirstError {
  bool seen = false;
  int line = 0;
  int column = 0;
  std::string message;
};

void keep_first_error(void* context, xmlErrorPtr error) {
  auto* first = static_cast<FirstError*>(static_cast<xmlParserCtxtPtr>(context)->_private);
  if (first == nullptr || first->seen || error->level < XML_ERR_ERROR) return;
  first->seen = true;
  first->line = error->line;
  first->column = error->int2;
  first->message = error->message == nullptr ? "not well-formed" : error->message;
}

std::string to_std(const xmlChar* text) {
  return text == nullptr ? std::string() : reinterpret_cast<const char*>(text);
}

std::string trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return std::string(text);
}

class TreeBuilder {
 public:
  TreeBuilder(const SourceText& source, const std::vector<TagPlace>& places,
              const XmlLimits& limits, Diagnostics& diagnostics)
      : source_(source), places_(places), limits_(limits), diagnostics_(diagnostics) {}

  std::optional<XmlElement> build(const xmlNode* node, int depth) {
    if (next_ >= places_.size()) {
      diagnostics_.error("XML-SCAN", source_, Span{1, 1, 1},
                         "the tags of this file cannot be located");
      return std::nullopt;
    }
    const TagPlace& place = places_[next_++];
    XmlElement element;
    element.name = to_std(node->name);
    if (node->ns != nullptr) element.namespace_uri = to_std(node->ns->href);
    element.span = source_.span_at(place.name_offset, place.name_length);
    if (depth > limits_.max_depth) {
      diagnostics_.error("XML-DEPTH", source_, element.span,
                         fmt::format("elements are nested more than {} deep", limits_.max_depth));
      return std::nullopt;
    }
    if (next_ > limits_.max_elements) {
      diagnostics_.error("XML-COUNT", source_, element.span,
                         fmt::format("more than {} elements", limits_.max_elements));
      return std::nullopt;
    }
    for (const xmlAttr* attr = node->properties; attr != nullptr; attr = attr->next) {
      element.attributes.push_back(build_attribute(attr, place));
    }
    std::string text;
    for (const xmlNode* child = node->children; child != nullptr; child = child->next) {
      if (child->type == XML_ELEMENT_NODE) {
        std::optional<XmlElement> built = build(child, depth + 1);
        if (!built) return std::nullopt;
        element.children.push_back(std::move(*built));
      } else if (child->type == XML_TEXT_NODE || child->type == XML_CDATA_SECTION_NODE) {
        text += to_std(child->content);
      }
    }
    element.text = trimmed(text);
    return element;
  }

 private:
  XmlAttribute build_attribute(const xmlAttr* attr, const TagPlace& place) const {
    XmlAttribute attribute;
    attribute.name = to_std(attr->name);
    std::string written = attribute.name;
    if (attr->ns != nullptr) {
      attribute.namespace_uri = to_std(attr->ns->href);
      if (attr->ns->prefix != nullptr) written = to_std(attr->ns->prefix) + ":" + attribute.name;
    }
    for (const xmlNode* part = attr->children; part != nullptr; part = part->next) {
      attribute.value += to_std(part->content);
    }
    for (const TagPlace::Attribute& candidate : place.attributes) {
      if (candidate.name == written) {
        attribute.name_span = source_.span_at(candidate.name_offset, written.size());
        attribute.value_span = source_.span_at(candidate.value_offset, candidate.value_length);
      }
    }
    return attribute;
  }

  const SourceText& source_;
  const std::vector<TagPlace>& places_;
  const XmlLimits& limits_;
  Diagnostics& diagnostics_;
  std::size_t next_ = 0;
};

// The encoding named in the XML declaration, in lower case; empty if there is none.
std::string declared_encoding(std::string_view text) {
  if (text.substr(0, 5) != "<?xml") return {};
  const std::string_view declaration = text.substr(0, std::min(text.find("?>"), text.size()));
  std::size_t at = declaration.find("encoding");
  if (at == std::string_view::npos) return {};
  at = declaration.find_first_of("\"'", at);
  if (at == std::string_view::npos) return {};
  const std::size_t end = declaration.find(declaration[at], at + 1);
  if (end == std::string_view::npos) return {};
  std::string name(declaration.substr(at + 1, end - at - 1));
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

bool check_encoding(const SourceText& source, std::string_view text, Diagnostics& diagnostics) {
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) {
    diagnostics.error("XML-ENCODING", source, source.span_at(nul, 1),
                      "the file is not UTF-8 text: it contains a zero byte",
                      "save it as UTF-8 (UTF-16 is not read)");
    return false;
  }
  const std::string encoding = declared_encoding(text);
  if (!encoding.empty() && encoding != "utf-8" && encoding != "utf8" && encoding != "us-ascii" &&
      encoding != "ascii") {
    diagnostics.error("XML-ENCODING", source, Span{1, 1, 5},
                      fmt::format("encoding '{}' is not read, only UTF-8", encoding),
                      "save the file as UTF-8 and declare encoding=\"UTF-8\"");
    return false;
  }
  return true;
}

}  // namespace

const XmlAttribute* XmlElement::attribute(std::string_view attribute_name) const {
  for (const XmlAttribute& candidate : attributes) {
    if (candidate.name == attribute_name && candidate.namespace_uri.empty()) return &candidate;
  }
  return nullptr;
}

const XmlElement* XmlElement::child(std::string_view child_name) const {
  for (const XmlElement& candidate : children) {
    if (candidate.name == child_name) return &candidate;
  }
  return nullptr;
}

std::optional<XmlDocument> parse_xml(SourceText source, const XmlLimits& limits,
                                     Diagnostics& diagnostics) {
  const std::string_view text = source.content();
  if (text.size() > limits.max_bytes) {
    diagnostics.error("XML-SIZE", source, Span{1, 1, 1},
                      fmt::format("the file is larger than {} KiB", limits.max_bytes / 1024));
    return std::nullopt;
  }
  if (!check_encoding(source, text, diagnostics)) return std::nullopt;

  TagScanner scanner(text);
  const std::vector<TagPlace> places = scanner.scan();
  if (scanner.doctype_offset()) {
    diagnostics.error("XML-DOCTYPE", source, source.span_at(*scanner.doctype_offset(), 9),
                      "a DOCTYPE is not accepted: it can define entities that grow without bound "
                      "or read other files",
                      "remove the DOCTYPE and write the text of its entities where they are used");
    return std::nullopt;
  }

  for (const TagPlace& place : places) {
    if (place.attributes.size() <= limits.max_attributes) continue;
    diagnostics.error("XML-COUNT", source, source.span_at(place.name_offset, place.name_length),
                      fmt::format("more than {} attributes", limits.max_attributes));
    return std::nullopt;
  }

  xmlInitParser();
  const std::unique_ptr<xmlParserCtxt, decltype(&xmlFreeParserCtxt)> context(xmlNewParserCtxt(),
                                                                             xmlFreeParserCtxt);
  FirstError first;
  context->_private = &first;
  context->sax->serror = keep_first_error;
  const std::unique_ptr<xmlDoc, decltype(&xmlFreeDoc)> document(
      xmlCtxtReadMemory(context.get(), text.data(), static_cast<int>(text.size()),
                        source.path().c_str(), nullptr,
                        XML_PARSE_NONET | XML_PARSE_NOWARNING | XML_PARSE_BIG_LINES),
      xmlFreeDoc);
  const xmlNode* root = document ? xmlDocGetRootElement(document.get()) : nullptr;
  if (first.seen || root == nullptr) {
    const Span span{std::max(first.line, 1), std::max(first.column, 1), 1};
    std::string message = first.seen ? trimmed(first.message) : "there is no element in this file";
    diagnostics.error("XML-SYNTAX", source, span, fmt::format("not well-formed XML: {}", message));
    return std::nullopt;
  }
  std::optional<XmlElement> tree = TreeBuilder(source, places, limits, diagnostics).build(root, 1);
  if (!tree) return std::nullopt;
  return XmlDocument{std::move(source), std::move(*tree)};
}

std::optional<XmlDocument> read_xml(const std::string& path, const XmlLimits& limits,
                                    Diagnostics& diagnostics) {
  tl::expected<SourceText, std::string> source = read_source_text(path, limits.max_bytes);
  if (!source) {
    diagnostics.unreadable(path, source.error());
    return std::nullopt;
  }
  return parse_xml(std::move(*source), limits, diagnostics);
}

std::optional<double> parse_number(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

std::optional<std::vector<double>> parse_numbers(std::string_view text, std::size_t count) {
  std::vector<double> values;
  std::size_t at = 0;
  while (at < text.size()) {
    if (is_space(text[at])) {
      ++at;
      continue;
    }
    const std::size_t end = std::min(text.find_first_of(" \t\r\n", at), text.size());
    const std::optional<double> value = parse_number(text.substr(at, end - at));
    if (!value || values.size() == count) return std::nullopt;
    values.push_back(*value);
    at = end;
  }
  if (values.size() != count) return std::nullopt;
  return values;
}

std::string escape_xml(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

}  // namespace dive
