#include "planning/cloud/rows.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include <fmt/format.h>

namespace dive::planning {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

template <class T>
double decode_as(const char* bytes, bool big_endian) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<T>(raw));
}

}  // namespace

double decode(NumberType type, const char* bytes, bool big_endian) {
  switch (type.kind) {
    case NumberType::Kind::kFloat:
      return type.size == 4 ? decode_as<float>(bytes, big_endian)
                            : decode_as<double>(bytes, big_endian);
    case NumberType::Kind::kSigned:
      switch (type.size) {
        case 1:
          return decode_as<std::int8_t>(bytes, big_endian);
        case 2:
          return decode_as<std::int16_t>(bytes, big_endian);
        case 4:
          return decode_as<std::int32_t>(bytes, big_endian);
        default:
          return decode_as<std::int64_t>(bytes, big_endian);
      }
    case NumberType::Kind::kUnsigned:
      switch (type.size) {
        case 1:
          return decode_as<std::uint8_t>(bytes, big_endian);
        case 2:
          return decode_as<std::uint16_t>(bytes, big_endian);
        case 4:
          return decode_as<std::uint32_t>(bytes, big_endian);
        default:
          return decode_as<std::uint64_t>(bytes, big_endian);
      }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

std::string read_text_rows(Input& input, const RowLayout& layout, std::uint64_t count,
                           RawCloud& cloud) {
  // A word takes at least two bytes; the second of the very last may be missing.
  cloud.points.reserve(static_cast<std::size_t>(
      std::min<std::uint64_t>(count, input.left() / (2 * layout.words) + 1)));
  std::array<std::string_view, 3> words;
  for (std::uint64_t i = 0; i < count;) {
    const auto line = input.line();
    if (!line) {
      return fmt::format("the header promises {} points and {} follow: {}", count, i,
                         input.failure());
    }
    std::string_view rest = *line;
    std::size_t seen = 0;
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (layout.xyz[axis].word == seen) words[axis] = word;
      }
      ++seen;
    }
    if (seen == 0) continue;
    if (seen != layout.words) {
      return fmt::format("line {} has {} values, and the header promises {}", input.line_number(),
                         seen, layout.words);
    }
    Eigen::Vector3d point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto value = to_number(words[axis]);
      if (!value) {
        return fmt::format("line {}: {} is \"{}\", which is not a number", input.line_number(),
                           "xyz"[axis], shown(words[axis]));
      }
      point[static_cast<Eigen::Index>(axis)] = *value;
    }
    cloud.add(point);
    ++i;
  }
  return {};
}

std::string read_binary_rows(Input& input, const RowLayout& layout, std::uint64_t count,
                             RawCloud& cloud) {
  if (count > input.left() / layout.bytes) {
    return fmt::format(
        "the header promises {} points of {} bytes and {} bytes follow: the file is cut short",
        count, layout.bytes, input.left());
  }
  cloud.points.reserve(count);
  cloud.single_precision =
      std::any_of(layout.xyz.begin(), layout.xyz.end(), [](const Column& column) {
        return column.type.kind == NumberType::Kind::kFloat && column.type.size == 4;
      });
  const std::uint64_t rows = std::max<std::uint64_t>(1, kChunkBytes / layout.bytes);
  std::vector<char> chunk(static_cast<std::size_t>(std::min(rows, count)) * layout.bytes);
  for (std::uint64_t left = count; left > 0;) {
    const auto now = static_cast<std::size_t>(std::min(rows, left));
    if (!input.read(chunk.data(), now * layout.bytes)) return "it could not be read to its end";
    for (std::size_t i = 0; i < now; ++i) {
      const char* row = chunk.data() + i * layout.bytes;
      Eigen::Vector3d point;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Column& column = layout.xyz[axis];
        point[static_cast<Eigen::Index>(axis)] =
            decode(column.type, row + column.offset, layout.big_endian);
      }
      cloud.add(point);
    }
    left -= now;
  }
  return {};
}

std::string expect_no_more_text(Input& input) {
  while (input.left() > 0) {
    std::optional<std::string_view> line = input.line();
    if (!line) return input.failure();
    if (!take_word(*line).empty()) {
      return fmt::format("line {} comes after the last point that the header promises",
                         input.line_number());
    }
  }
  return {};
}

void warn_of_more_bytes(const Input& input, RawCloud& cloud) {
  if (input.left() == 0) return;
  cloud.warnings.push_back(fmt::format("{} bytes after the last point are left out", input.left()));
}

std::string check_count(std::uint64_t promised, std::size_t most) {
  if (promised == 0) return "it holds no points";
  if (promised <= most) return {};
  return fmt::format("the header promises {} points, and {} are read at most", promised, most);
}

}  // namespace dive::planning
