#include "mission/diff/document_difference.h"

#include <algorithm>
#include <map>
#include <optional>
#include <sstream>
#include <utility>

#include <fmt/format.h>

namespace dive::mission {
namespace {

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(std::move(word));
  return words;
}

bool is_same_word(const std::string& a, const std::string& b) {
  if (a == b) return true;
  const std::optional<double> number = parse_number(a);
  return number && number == parse_number(b);
}

bool is_same_value(const std::string& a, const std::string& b) {
  return a == b || std::ranges::equal(words_of(a), words_of(b), is_same_word);
}

std::string attribute_or(const XmlElement& element, std::string_view name) {
  const XmlAttribute* found = element.attribute(name);
  return found == nullptr ? "" : found->value;
}

// "goto[gate]"; the name alone for an element that nothing identifies.
std::string label_of(const XmlElement& element) {
  for (const char* name : {"id", "name", "event"}) {
    if (const std::string value = attribute_or(element, name); !value.empty()) {
      return fmt::format("{}[{}]", element.name, value);
    }
  }
  return element.name;
}

struct Child {
  std::string key;  ///< Label, with a number from the second of the same label on.
  const XmlElement* element = nullptr;
  bool is_ordered = false;  ///< Identified or repeated: its place among such elements counts.
};

std::vector<Child> children_of(const XmlElement& parent) {
  std::map<std::string, int> count;
  std::map<std::string, int> by_name;
  for (const XmlElement& child : parent.children) ++by_name[child.name];
  std::vector<Child> children;
  for (const XmlElement& child : parent.children) {
    const std::string label = label_of(child);
    const int number = ++count[label];
    children.push_back({number == 1 ? label : fmt::format("{} ({})", label, number), &child,
                        label != child.name || by_name[child.name] > 1});
  }
  return children;
}

class Comparison {
 public:
  void element(const XmlElement& a, const XmlElement& b, const std::string& path) {
    attributes(a, b, path);
    if (!is_same_value(a.text, b.text)) add(path + "/text()", a.text, b.text);
    children(a, b, path);
  }
  [[nodiscard]] std::vector<Difference> take() { return std::move(differences_); }

 private:
  void add(std::string what, std::string a, std::string b) {
    if (what.starts_with('/')) what.erase(0, 1);
    differences_.push_back({std::move(what), std::move(a), std::move(b)});
  }

  void attributes(const XmlElement& a, const XmlElement& b, const std::string& path) {
    for (const XmlAttribute& each : a.attributes) {
      const XmlAttribute* other = b.attribute(each.name);
      const std::string name = fmt::format("{}/@{}", path, each.name);
      if (other == nullptr) {
        add(name, each.value, "");
      } else if (!is_same_value(each.value, other->value)) {
        add(name, each.value, other->value);
      }
    }
    for (const XmlAttribute& each : b.attributes) {
      if (a.attribute(each.name) != nullptr) continue;
      add(fmt::format("{}/@{}", path, each.name), "", each.value);
    }
  }

  void children(const XmlElement& a, const XmlElement& b, const std::string& path) {
    const std::vector<Child> of_a = children_of(a);
    const std::vector<Child> of_b = children_of(b);
    const auto find = [](const std::vector<Child>& in, const std::string& key) {
      return std::ranges::find(in, key, &Child::key);
    };
    std::vector<std::string> order_a;
    std::vector<std::string> order_b;
    for (const Child& each : of_a) {
      const auto other = find(of_b, each.key);
      const std::string name = fmt::format("{}/{}", path, each.key);
      if (other == of_b.end()) {
        add(name, "is there", "");
        continue;
      }
      if (each.is_ordered) order_a.push_back(each.key);
      element(*each.element, *other->element, name);
    }
    for (const Child& each : of_b) {
      if (find(of_a, each.key) == of_a.end()) {
        add(fmt::format("{}/{}", path, each.key), "", "is there");
      } else if (each.is_ordered) {
        order_b.push_back(each.key);
      }
    }
    std::erase_if(order_b, [&](const std::string& key) {
      return std::ranges::find(order_a, key) == order_a.end();
    });
    if (order_a.size() != order_b.size() || order_a == order_b) return;
    const auto [first, second] = std::ranges::mismatch(order_a, order_b);
    add(fmt::format("{}/order", path), *first, *second);
  }

  std::vector<Difference> differences_;
};

}  // namespace

std::vector<Difference> document_differences(const XmlElement& a, const XmlElement& b) {
  Comparison comparison;
  if (a.name != b.name) return {{"root", a.name, b.name}};
  comparison.element(a, b, "");
  return comparison.take();
}

}  // namespace dive::mission
