#include "mission/document/schema.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <libxml/parser.h>
#include <libxml/tree.h>
#include <libxml/xmlerror.h>
#include <libxml/xmlschemas.h>

#include "common/assert.h"
#include "mission/document/schema_words.h"

namespace dive::mission {
namespace {

using DocumentHandle = std::unique_ptr<xmlDoc, decltype(&xmlFreeDoc)>;
using SchemaHandle = std::unique_ptr<xmlSchema, decltype(&xmlSchemaFree)>;

constexpr int kMaxRounds = 50;  // validation passes, each after at least one repair
constexpr const char* kSchemaInstance = "http://www.w3.org/2001/XMLSchema-instance";

const char* chars(const xmlChar* text) {
  return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}

void ignore(void*, xmlErrorPtr) {}

SchemaHandle compile_schema(const char* text) {
  const std::unique_ptr<xmlSchemaParserCtxt, decltype(&xmlSchemaFreeParserCtxt)> context(
      xmlSchemaNewMemParserCtxt(text, static_cast<int>(std::strlen(text))),
      xmlSchemaFreeParserCtxt);
  xmlSchemaSetParserStructuredErrors(context.get(), ignore, nullptr);
  SchemaHandle schema(xmlSchemaParse(context.get()), xmlSchemaFree);
  DIVE_DEMAND(schema != nullptr);
  return schema;
}

// Parses the document again into libxml2's tree: parse_xml has accepted it as well-formed and safe.
DocumentHandle parse_again(const SourceText& source) {
  const std::string& text = source.content();
  DocumentHandle document(
      xmlReadMemory(
          text.data(), static_cast<int>(text.size()), source.path().c_str(), nullptr,
          XML_PARSE_NONET | XML_PARSE_NOWARNING | XML_PARSE_NOERROR | XML_PARSE_BIG_LINES),
      xmlFreeDoc);
  DIVE_DEMAND(document != nullptr);
  return document;
}

// A finding of libxml2, kept until validation is over, because the tree must not be repaired during
// it.
struct Finding {
  int code = 0;
  xmlNode* node = nullptr;
  std::string attribute;  ///< Name of the attribute concerned, or empty.
  std::string message;
};

void keep_finding(void* context, xmlErrorPtr error) {
  const std::string message = error->message == nullptr ? "" : error->message;
  Finding finding{error->code, static_cast<xmlNode*>(error->node), {}, message};
  constexpr std::string_view kMark = "attribute '";
  if (const std::size_t at = message.find(kMark); at != std::string::npos) {
    const std::size_t begin = at + kMark.size();
    finding.attribute = message.substr(begin, message.find('\'', begin) - begin);
    const std::size_t brace = finding.attribute.rfind('}');
    if (brace != std::string::npos) finding.attribute.erase(0, brace + 1);
  }
  static_cast<std::vector<Finding>*>(context)->push_back(std::move(finding));
}

// Walks both trees in step and links every libxml2 node to its element.
void link(xmlNode* node, const XmlElement& element) {
  node->_private = const_cast<XmlElement*>(&element);
  std::size_t next = 0;
  for (xmlNode* child = node->children; child != nullptr; child = child->next) {
    if (child->type == XML_ELEMENT_NODE) link(child, element.children.at(next++));
  }
}

const XmlElement& element_of(const xmlNode* node) {
  return *static_cast<const XmlElement*>(node->_private);
}

class SchemaCheck {
 public:
  SchemaCheck(const XmlDocument& document, const Language& language, Diagnostics& diagnostics)
      : words_(document.source, language, diagnostics),
        language_(language),
        schema_(compile_schema(language.source().text)),
        tree_(parse_again(document.source)) {
    xmlNode* root = xmlDocGetRootElement(tree_.get());
    link(root, document.root);
    take_out_instance_attributes(root);
  }

  ~SchemaCheck() {
    for (xmlNode* node : taken_out_) xmlFreeNode(node);
  }
  SchemaCheck(const SchemaCheck&) = delete;
  SchemaCheck& operator=(const SchemaCheck&) = delete;

  bool valid() {
    bool valid = !found_something_;
    for (int round = 0; round < kMaxRounds; ++round) {
      const std::vector<Finding> findings = validate();
      if (findings.empty()) return valid;
      valid = false;
      bool repaired = false;
      for (const Finding& finding : findings) repaired |= explain(finding);
      if (!repaired) break;
    }
    return false;
  }

 private:
  std::vector<Finding> validate() {
    std::vector<Finding> findings;
    const std::unique_ptr<xmlSchemaValidCtxt, decltype(&xmlSchemaFreeValidCtxt)> context(
        xmlSchemaNewValidCtxt(schema_.get()), xmlSchemaFreeValidCtxt);
    DIVE_DEMAND(context != nullptr);
    xmlSchemaSetValidStructuredErrors(context.get(), keep_finding, &findings);
    const int result = xmlSchemaValidateDoc(context.get(), tree_.get());
    DIVE_DEMAND(result >= 0 && (result == 0) == findings.empty());
    return findings;
  }

  // xsi:schemaLocation is a hint for editors; libxml2 would load the file. The other xsi attributes
  // would change the type of an element.
  void take_out_instance_attributes(xmlNode* node) {
    for (xmlAttr* attr = node->properties; attr != nullptr;) {
      xmlAttr* next = attr->next;
      if (attr->ns != nullptr && std::strcmp(chars(attr->ns->href), kSchemaInstance) == 0) {
        const std::string name = chars(attr->name);
        if (name != "schemaLocation" && name != "noNamespaceSchemaLocation") {
          words_.unknown_attribute(element_of(node), type_of(node), name);
          found_something_ = true;
        }
        xmlRemoveProp(attr);
      }
      attr = next;
    }
    for (xmlNode* child = node->children; child != nullptr; child = child->next) {
      if (child->type == XML_ELEMENT_NODE) take_out_instance_attributes(child);
    }
  }

  // Type of a node by its current name, which a repair may have changed.
  std::string type_of(const xmlNode* node) const {
    const xmlNode* parent = node->parent;
    const bool is_root = parent == nullptr || parent->type != XML_ELEMENT_NODE;
    return language_.type(is_root ? std::string() : type_of(parent), chars(node->name));
  }

  // Reports a finding once; true if the tree was repaired, so that more can be found.
  bool explain(const Finding& finding) {
    DIVE_DEMAND(finding.node != nullptr);
    if (taken_out_.count(finding.node) != 0) return false;
    const XmlElement& element = element_of(finding.node);
    if (finding.code == XML_SCHEMAV_ELEMENT_CONTENT) return explain_content(finding);
    // libxml2 often reports one bad value several times, so an attribute is reported once.
    const int key = finding.attribute.empty() ? finding.code : 0;
    if (!reported_.insert({finding.node, key, finding.attribute}).second) return false;
    switch (finding.code) {
      case XML_SCHEMAV_CVC_COMPLEX_TYPE_3_2_1:
      case XML_SCHEMAV_CVC_COMPLEX_TYPE_3_2_2:
        words_.unknown_attribute(element, type_of(finding.node), finding.attribute);
        break;
      case XML_SCHEMAV_CVC_COMPLEX_TYPE_4:
        words_.missing_attribute(element, type_of(finding.node), finding.attribute);
        break;
      case XML_SCHEMAV_CVC_COMPLEX_TYPE_2_1:
      case XML_SCHEMAV_CVC_COMPLEX_TYPE_2_3:
        words_.stray_text(element);
        break;
      default:
        words_.bad_value(element, type_of(finding.node), finding.attribute, finding.message);
    }
    return false;
  }

  // An element in the wrong place, or one with missing content.
  bool explain_content(const Finding& finding) {
    xmlNode* node = finding.node;
    const std::vector<std::string> expected = expected_in(finding.message);
    const bool is_first = reported_.insert({node, finding.code, {}}).second;
    if (finding.message.find("Missing child") != std::string::npos) {
      if (is_first) words_.missing_children(element_of(node), type_of(node), expected);
      return false;
    }
    if (is_first && rename(node)) return true;
    xmlNode* parent = node->parent;
    if (is_first && is_known(node)) {
      if (!is_early(expected, node)) {
        words_.misplaced_element(element_of(node), element_of(parent), type_of(parent), expected);
      } else if (reported_.insert({parent, finding.code, {}}).second) {
        words_.missing_children(element_of(parent), type_of(parent), expected);
      }
    }
    // An unknown element may have been meant to be the missing one.
    if (!is_known(node)) reported_.insert({parent, finding.code, {}});
    xmlUnlinkNode(node);
    taken_out_.insert(node);
    return true;
  }

  // Reports an unknown element; true if it was renamed to the name probably meant.
  bool rename(xmlNode* node) {
    if (is_known(node)) return false;
    const auto meant =
        words_.unknown_element(element_of(node), element_of(node->parent), type_of(node->parent));
    if (!meant) return false;
    xmlNodeSetName(node, reinterpret_cast<const xmlChar*>(meant->c_str()));
    xmlSetNs(node, node->parent->ns);
    return true;
  }

  [[nodiscard]] bool is_known(const xmlNode* node) const {
    return in_language(node) && language_.rule(type_of(node->parent), chars(node->name)) != nullptr;
  }

  [[nodiscard]] bool in_language(const xmlNode* node) const {
    return node->ns != nullptr &&
           std::strcmp(chars(node->ns->href), language_.source().namespace_uri) == 0;
  }

  // True if this element only precedes a required one that is missing everywhere.
  [[nodiscard]] bool is_early(const std::vector<std::string>& expected, const xmlNode* node) const {
    const ElementRule& rule = language_.type_rule(type_of(node->parent));
    const auto is_there = [node](const std::string& name) {
      const xmlNode* child = node->parent->children;
      while (child != nullptr && name != chars(child->name)) child = child->next;
      return child != nullptr;
    };
    if (!rule.one_of.empty() && std::none_of(rule.one_of.begin(), rule.one_of.end(), is_there)) {
      return true;
    }
    const auto& required = rule.required_children;
    return std::any_of(expected.begin(), expected.end(), [&](const std::string& name) {
      return std::find(required.begin(), required.end(), name) != required.end() && !is_there(name);
    });
  }

  // The names in libxml2's "Expected is one of ( {uri}a, {uri}b )."
  static std::vector<std::string> expected_in(const std::string& message) {
    std::vector<std::string> names;
    for (std::size_t at = message.find("Expected is"); at < message.size();) {
      at = message.find('}', at);
      if (at == std::string::npos) break;
      const std::size_t end = message.find_first_of(", )", at);
      names.push_back(message.substr(at + 1, end - at - 1));
      at = end;
    }
    return names;
  }

  SchemaWords words_;
  const Language& language_;
  SchemaHandle schema_;
  DocumentHandle tree_;
  std::set<xmlNode*> taken_out_;
  std::set<std::tuple<const xmlNode*, int, std::string>> reported_;
  bool found_something_ = false;
};

}  // namespace

bool check_schema(const XmlDocument& document, const Language& language, Diagnostics& diagnostics) {
  const SchemaSource& source = language.source();
  if (document.root.name != source.root || document.root.namespace_uri != source.namespace_uri) {
    SchemaWords(document.source, language, diagnostics).wrong_root(document.root);
    return false;
  }
  return SchemaCheck(document, language, diagnostics).valid();
}

}  // namespace dive::mission
