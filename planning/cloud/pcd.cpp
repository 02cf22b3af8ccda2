// Our own reader: PCL's is in pcl_io, which links TinyXML and trusts the header.

#include "planning/cloud/pcd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include <fmt/format.h>
#include <liblzf/lzf.h>

namespace dive::planning {
namespace {

constexpr std::array<std::string_view, 11> kKeywords = {"VERSION",   "FIELDS", "COLUMNS", "SIZE",
                                                        "TYPE",      "COUNT",  "WIDTH",   "HEIGHT",
                                                        "VIEWPOINT", "POINTS", "DATA"};
constexpr std::array<std::string_view, 6> kVersions = {".5", "0.5", ".6", "0.6", ".7", "0.7"};
constexpr std::uint64_t kMaxUnpacked = std::uint64_t{1} << 31;
// Three bytes of LZF expand to at most 264.
constexpr std::uint64_t kMaxLzfRatio = 88;

struct Entry {
  std::size_t line = 0;
  std::vector<std::string> words;  ///< Words without the keyword.
};
using PcdHeader = std::map<std::string, Entry, std::less<>>;

struct Field {
  std::string name;
  NumberType type;
  std::uint64_t count = 1;
};

tl::expected<PcdHeader, std::string> read_pcd_header(Input& input) {
  PcdHeader header;
  while (!header.contains("DATA")) {
    const auto line = input.line();
    if (!line) return refuse("its header has no DATA line: " + input.failure());
    if (input.taken() > kMaxHeaderLength) return refuse("its header is longer than 1 MiB");
    const std::vector<std::string_view> words = words_of(*line);
    if (words.empty() || words[0].starts_with('#')) continue;
    std::string keyword(words[0]);
    if (std::find(kKeywords.begin(), kKeywords.end(), keyword) == kKeywords.end()) {
      return refuse(fmt::format("line {}: \"{}\" is not a word of a PCD header",
                                input.line_number(), shown(keyword)));
    }
    if (keyword == "COLUMNS") keyword = "FIELDS";
    if (header.contains(keyword)) {
      return refuse(fmt::format("line {} gives {} again", input.line_number(), keyword));
    }
    header[keyword] = {input.line_number(), {words.begin() + 1, words.end()}};
  }
  return header;
}

const Entry* find(const PcdHeader& header, std::string_view keyword) {
  const auto found = header.find(keyword);
  return found == header.end() ? nullptr : &found->second;
}

bool is_number_type(char type, std::uint64_t size) {
  if (type == 'F') return size == 4 || size == 8;
  return (type == 'I' || type == 'U') && (size == 1 || size == 2 || size == 4 || size == 8);
}

tl::expected<std::vector<Field>, std::string> read_fields(const PcdHeader& header) {
  const Entry* names = find(header, "FIELDS");
  if (names == nullptr) return refuse("its header has no FIELDS line");
  std::vector<Field> fields;
  fields.reserve(names->words.size());
  for (const std::string& name : names->words) fields.push_back({name, {}, 1});

  for (const std::string_view keyword : {"SIZE", "TYPE", "COUNT"}) {
    const Entry* entry = find(header, keyword);
    if (entry != nullptr && entry->words.size() != fields.size()) {
      return refuse(fmt::format("line {}: {} has {} entries, and FIELDS has {}", entry->line,
                                keyword, entry->words.size(), fields.size()));
    }
  }
  const Entry* sizes = find(header, "SIZE");
  const Entry* types = find(header, "TYPE");
  const Entry* counts = find(header, "COUNT");
  const Entry* data = find(header, "DATA");
  const bool is_text = data->words.size() == 1 && data->words[0] == "ascii";
  if (!is_text && (sizes == nullptr || types == nullptr)) {
    return refuse("its header has no SIZE or no TYPE line, and its data is binary");
  }
  for (std::size_t i = 0; i < fields.size(); ++i) {
    Field& field = fields[i];
    if (sizes != nullptr && types != nullptr) {
      const std::string& type = types->words[i];
      const auto size = to_count(sizes->words[i]);
      if (type.size() != 1 || !size || !is_number_type(type[0], *size)) {
        return refuse(
            fmt::format("line {}: field {} is of type {} and size {}, and there are F of 4 or 8, I "
                        "and U of 1, 2, 4 or 8",
                        types->line, shown(field.name), shown(type), shown(sizes->words[i])));
      }
      field.type = {type[0] == 'F'   ? NumberType::Kind::kFloat
                    : type[0] == 'I' ? NumberType::Kind::kSigned
                                     : NumberType::Kind::kUnsigned,
                    *size};
    }
    if (counts == nullptr) continue;
    const auto count = to_count(counts->words[i]);
    if (!count || *count == 0 || *count > kMaxRowLength) {
      return refuse(fmt::format("line {}: the COUNT of field {} is \"{}\"", counts->line,
                                shown(field.name), shown(counts->words[i])));
    }
    field.count = *count;
  }
  return fields;
}

tl::expected<RowLayout, std::string> lay_out(const std::vector<Field>& fields, std::size_t line) {
  RowLayout layout;
  std::array<bool, 3> has{};
  for (const Field& field : fields) {
    const std::size_t axis = std::string_view("xyz").find(field.name);
    if (field.name.size() == 1 && axis < 3) {
      if (has[axis]) return refuse(fmt::format("line {} names {} twice", line, field.name));
      if (field.count != 1) return refuse(fmt::format("the COUNT of {} is not 1", field.name));
      has[axis] = true;
      layout.xyz[axis] = {layout.words, layout.bytes, field.type};
    }
    layout.words += field.count;
    layout.bytes += field.count * field.type.size;
    if (layout.bytes > kMaxRowLength) {
      return refuse(fmt::format("a point of it takes more than {} bytes", kMaxRowLength));
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!has[axis]) return refuse(fmt::format("line {}: there is no field {}", line, "xyz"[axis]));
  }
  return layout;
}

tl::expected<std::uint64_t, std::string> count_points(const PcdHeader& header) {
  std::map<std::string_view, std::uint64_t> numbers;
  for (const std::string_view keyword : {"WIDTH", "HEIGHT", "POINTS"}) {
    const Entry* entry = find(header, keyword);
    if (entry == nullptr) continue;
    const auto value = entry->words.size() == 1 ? to_count(entry->words[0]) : std::nullopt;
    if (!value) return refuse(fmt::format("line {}: {} is not a count", entry->line, keyword));
    numbers[keyword] = *value;
  }
  if (!numbers.contains("POINTS") && !numbers.contains("WIDTH")) {
    return refuse("its header has neither POINTS nor WIDTH");
  }
  if (!numbers.contains("WIDTH")) return numbers["POINTS"];
  const std::uint64_t width = numbers["WIDTH"];
  const std::uint64_t height = numbers.contains("HEIGHT") ? numbers["HEIGHT"] : 1;
  if (height != 0 && width > std::numeric_limits<std::uint64_t>::max() / height) {
    return refuse(fmt::format("its header promises {} x {} points", width, height));
  }
  if (numbers.contains("POINTS") && numbers["POINTS"] != width * height) {
    return refuse(fmt::format("its header promises {} points, and also {} x {}", numbers["POINTS"],
                              width, height));
  }
  return width * height;
}

// tx ty tz qw qx qy qz
std::string read_viewpoint(const Entry& entry, RawCloud& cloud) {
  std::array<double, 7> numbers{};
  bool good = entry.words.size() == numbers.size();
  for (std::size_t i = 0; good && i < numbers.size(); ++i) {
    const auto number = to_number(entry.words[i]);
    good = number && std::isfinite(*number);
    if (good) numbers[i] = *number;
  }
  if (!good) return fmt::format("line {}: VIEWPOINT is not seven numbers", entry.line);
  const Eigen::Quaterniond q(numbers[3], numbers[4], numbers[5], numbers[6]);
  if (!(std::abs(q.norm() - 1.0) < 1e-2)) {
    cloud.warnings.push_back(fmt::format(
        "line {}: the quaternion of VIEWPOINT is not of length 1; VIEWPOINT is left out",
        entry.line));
    return {};
  }
  cloud.viewpoint = Pose{{numbers[0], numbers[1], numbers[2]}, q.normalized()};
  return {};
}

// Two sizes, then all x, all y, and so on, compressed with LZF as one block.
std::string read_compressed(Input& input, const RowLayout& layout, std::uint64_t count,
                            RawCloud& cloud) {
  std::array<std::uint32_t, 2> sizes{};
  std::array<char, 8> raw{};
  if (!input.read(raw.data(), raw.size())) return "it ends before its compressed data";
  std::memcpy(sizes.data(), raw.data(), raw.size());
  const auto [packed, unpacked] = sizes;
  // Neither factor is large enough for the product to overflow.
  if (count > kMaxUnpacked || count * layout.bytes != unpacked) {
    return fmt::format("{} points of {} bytes do not unpack to {} bytes", count, layout.bytes,
                       unpacked);
  }
  if (unpacked > kMaxUnpacked) {
    return fmt::format("it unpacks to {} bytes, and {} are read at most", unpacked, kMaxUnpacked);
  }
  if (packed > input.left()) {
    return fmt::format(
        "{} bytes of compressed data are promised and {} follow: the file is cut "
        "short",
        packed, input.left());
  }
  if (unpacked > packed * kMaxLzfRatio) {
    return fmt::format("{} bytes of compressed data cannot hold {}", packed, unpacked);
  }
  std::vector<char> columns(unpacked);
  {
    std::vector<char> data(packed);
    if (!input.read(data.data(), data.size())) return "it could not be read to its end";
    if (lzf_decompress(data.data(), packed, columns.data(), unpacked) != unpacked) {
      return "its compressed data is damaged";
    }
  }
  cloud.points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3d point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto& [word, offset, type] = layout.xyz[axis];
      point[static_cast<Eigen::Index>(axis)] =
          decode(type, columns.data() + offset * count + i * type.size, false);
      cloud.single_precision |= type.kind == NumberType::Kind::kFloat && type.size == 4;
    }
    cloud.add(point);
  }
  return {};
}

}  // namespace

bool looks_like_pcd(std::string_view head) {
  if (head.starts_with("# .PCD")) return true;
  while (!head.empty()) {
    std::string_view line = head.substr(0, head.find('\n'));
    head.remove_prefix(std::min(head.size(), line.size() + 1));
    const std::string_view word = take_word(line);
    if (word.empty() || word.starts_with('#')) continue;
    return std::find(kKeywords.begin(), kKeywords.end(), word) != kKeywords.end();
  }
  return false;
}

tl::expected<RawCloud, std::string> read_pcd(Input& input, std::size_t max_points) {
  const auto header = read_pcd_header(input);
  if (!header) return refuse(header.error());
  if (const Entry* version = find(*header, "VERSION")) {
    const std::string text = version->words.empty() ? "" : version->words[0];
    if (std::find(kVersions.begin(), kVersions.end(), text) == kVersions.end()) {
      return refuse(fmt::format("line {}: version \"{}\" of PCD is not known; .5, .6 and .7 are",
                                version->line, shown(text)));
    }
  }
  const auto fields = read_fields(*header);
  if (!fields) return refuse(fields.error());
  const auto layout = lay_out(*fields, find(*header, "FIELDS")->line);
  if (!layout) return refuse(layout.error());
  const auto count = count_points(*header);
  if (!count) return refuse(count.error());
  std::string failed = check_count(*count, max_points);
  if (!failed.empty()) return refuse(std::move(failed));

  RawCloud cloud;
  if (const Entry* viewpoint = find(*header, "VIEWPOINT")) {
    failed = read_viewpoint(*viewpoint, cloud);
    if (!failed.empty()) return refuse(std::move(failed));
  }
  const Entry* data = find(*header, "DATA");
  const std::string encoding = data->words.size() == 1 ? data->words[0] : "";
  if (encoding == "ascii") {
    failed = read_text_rows(input, *layout, *count, cloud);
    if (failed.empty()) failed = expect_no_more_text(input);
  } else if (encoding == "binary") {
    failed = read_binary_rows(input, *layout, *count, cloud);
    warn_of_more_bytes(input, cloud);
  } else if (encoding == "binary_compressed") {
    // The rest is padding: the sizes prove that all points were read.
    failed = read_compressed(input, *layout, *count, cloud);
  } else {
    failed = fmt::format("line {}: DATA is ascii, binary or binary_compressed", data->line);
  }
  if (!failed.empty()) return refuse(std::move(failed));
  return cloud;
}

}  // namespace dive::planning
