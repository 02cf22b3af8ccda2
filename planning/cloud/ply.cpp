// Our own reader: CGAL's allocates the list sizes of the header, up to 16 GB each, and reads
// vertices without x, y and z as zeros.

#include "planning/cloud/ply.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace dive::planning {
namespace {

using Kind = NumberType::Kind;

struct Property {
  std::string name;
  NumberType type;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
  bool has_lists = false;
};

struct PlyHeader {
  std::string encoding;
  std::vector<Element> elements;
};

std::optional<NumberType> type_of(std::string_view name) {
  struct Named {
    std::string_view name;
    NumberType type;
  };
  static constexpr std::array<Named, 16> kTypes = {{{"char", {Kind::kSigned, 1}},
                                                    {"int8", {Kind::kSigned, 1}},
                                                    {"uchar", {Kind::kUnsigned, 1}},
                                                    {"uint8", {Kind::kUnsigned, 1}},
                                                    {"short", {Kind::kSigned, 2}},
                                                    {"int16", {Kind::kSigned, 2}},
                                                    {"ushort", {Kind::kUnsigned, 2}},
                                                    {"uint16", {Kind::kUnsigned, 2}},
                                                    {"int", {Kind::kSigned, 4}},
                                                    {"int32", {Kind::kSigned, 4}},
                                                    {"uint", {Kind::kUnsigned, 4}},
                                                    {"uint32", {Kind::kUnsigned, 4}},
                                                    {"float", {Kind::kFloat, 4}},
                                                    {"float32", {Kind::kFloat, 4}},
                                                    {"double", {Kind::kFloat, 8}},
                                                    {"float64", {Kind::kFloat, 8}}}};
  const auto* found = std::find_if(kTypes.begin(), kTypes.end(),
                                   [name](const Named& named) { return named.name == name; });
  if (found == kTypes.end()) return std::nullopt;
  return found->type;
}

// Adds one line of the header; false if it is invalid.
bool take_line(const std::vector<std::string_view>& words, PlyHeader& header) {
  if (words[0] == "format") {
    if (words.size() != 3 || !header.encoding.empty() || words[2] != "1.0") return false;
    header.encoding = words[1];
    return true;
  }
  if (words[0] == "element") {
    const auto count = words.size() == 3 ? to_count(words[2]) : std::nullopt;
    if (!count) return false;
    header.elements.push_back({std::string(words[1]), *count, {}, false});
    return true;
  }
  if (words[0] != "property" || header.elements.empty()) return false;
  Element& element = header.elements.back();
  if (words.size() == 5 && words[1] == "list") {
    const auto sizes = type_of(words[2]);
    element.has_lists = true;
    return sizes && sizes->kind != Kind::kFloat && type_of(words[3]);
  }
  const auto type = words.size() == 3 ? type_of(words[1]) : std::nullopt;
  if (type) element.properties.push_back({std::string(words[2]), *type});
  return type.has_value();
}

tl::expected<PlyHeader, std::string> read_ply_header(Input& input) {
  PlyHeader header;
  for (;;) {
    const auto line = input.line();
    if (!line) return refuse("its header has no end_header: " + input.failure());
    if (input.taken() > kMaxHeaderLength) return refuse("its header is longer than 1 MiB");
    if (input.line_number() == 1) continue;
    const std::vector<std::string_view> words = words_of(*line);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") return header;
    if (!take_line(words, header)) {
      return refuse(fmt::format("line {}: \"{}\" has no place in a PLY 1.0 header",
                                input.line_number(), shown(*line)));
    }
  }
}

tl::expected<RowLayout, std::string> lay_out(const Element& element) {
  if (element.has_lists) return refuse("its vertices have lists, which are not read");
  RowLayout layout;
  std::array<bool, 3> has{};
  for (const Property& property : element.properties) {
    const std::size_t axis = std::string_view("xyz").find(property.name);
    if (property.name.size() == 1 && axis < 3) {
      if (has[axis]) return refuse(fmt::format("its vertices have {} twice", property.name));
      has[axis] = true;
      layout.xyz[axis] = {layout.words, layout.bytes, property.type};
    }
    ++layout.words;
    layout.bytes += property.type.size;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!has[axis]) return refuse(fmt::format("its vertices have no {}", "xyz"[axis]));
  }
  if (layout.bytes > kMaxRowLength) {
    return refuse(fmt::format("a vertex of it takes more than {} bytes", kMaxRowLength));
  }
  return layout;
}

std::string skip_element(Input& input, const Element& element, bool is_text) {
  if (is_text) {
    for (std::uint64_t i = 0; i < element.count;) {
      std::optional<std::string_view> line = input.line();
      if (!line) return fmt::format("its element {} is cut short", shown(element.name));
      if (!take_word(*line).empty()) ++i;
    }
    return {};
  }
  if (element.has_lists) {
    return fmt::format("its element {} has lists and comes before the vertices, which is not read",
                       shown(element.name));
  }
  std::uint64_t bytes = 0;
  for (const Property& property : element.properties) bytes += property.type.size;
  if (bytes == 0) return {};
  if (element.count > input.left() / bytes || !input.skip(element.count * bytes)) {
    return fmt::format("its element {} is cut short", shown(element.name));
  }
  return {};
}

}  // namespace

bool looks_like_ply(std::string_view head) {
  return head.starts_with("ply\n") || head.starts_with("ply\r\n") || head.starts_with("ply ");
}

tl::expected<RawCloud, std::string> read_ply(Input& input, std::size_t max_points) {
  const auto header = read_ply_header(input);
  if (!header) return refuse(header.error());
  const bool is_text = header->encoding == "ascii";
  const bool is_big = header->encoding == "binary_big_endian";
  if (!is_text && !is_big && header->encoding != "binary_little_endian") {
    return refuse(
        fmt::format("its format is \"{}\", and ascii, binary_little_endian and "
                    "binary_big_endian are known",
                    shown(header->encoding)));
  }
  const auto vertices =
      std::find_if(header->elements.begin(), header->elements.end(),
                   [](const Element& element) { return element.name == "vertex"; });
  if (vertices == header->elements.end()) return refuse("it has no element vertex");
  auto layout = lay_out(*vertices);
  if (!layout) return refuse(layout.error());
  layout->big_endian = is_big;
  std::string failed = check_count(vertices->count, max_points);
  if (!failed.empty()) return refuse(std::move(failed));

  RawCloud cloud;
  for (auto element = header->elements.begin(); element != vertices; ++element) {
    failed = skip_element(input, *element, is_text);
    if (!failed.empty()) return refuse(std::move(failed));
  }
  failed = is_text ? read_text_rows(input, *layout, vertices->count, cloud)
                   : read_binary_rows(input, *layout, vertices->count, cloud);
  bool is_last = true;
  for (auto element = vertices + 1; element != header->elements.end(); ++element) {
    if (element->count == 0) continue;
    is_last = false;
    cloud.warnings.push_back(
        fmt::format("{} of its element {} are left out; vertices alone are read", element->count,
                    shown(element->name)));
  }
  if (failed.empty() && is_last && is_text) failed = expect_no_more_text(input);
  if (is_last && !is_text) warn_of_more_bytes(input, cloud);
  if (!failed.empty()) return refuse(std::move(failed));
  return cloud;
}

}  // namespace dive::planning
