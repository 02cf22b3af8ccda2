#include "planning/world/grid.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <istream>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "common/input_file.h"
#include "common/xml.h"
#include "planning/world/geotiff.h"
#include "planning/world/height_grid.h"

namespace dive::planning {
namespace {

using namespace std::string_view_literals;

// The first bytes of a TIFF or a BigTIFF, in either order of bytes.
constexpr std::array<std::string_view, 4> kTiff{"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv};
constexpr std::string_view kBlanks = " \t\r\n";

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

struct Header {
  HeightGrid grid;  // without heights
  double no_data = -9999.0;
};

bool begins_like_tiff(std::string_view head) {
  return std::ranges::any_of(kTiff,
                             [&](std::string_view magic) { return head.starts_with(magic); });
}

// After blanks, as an ESRI ASCII grid may begin with them; empty if the file cannot be read.
std::string head_of(const std::string& path) {
  const auto file = open_input_stream(path);
  if (!file) return {};
  std::string head(16, '\0');
  (**file >> std::ws).read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>((*file)->gcount()));
  return head;
}

class GridReader {
 public:
  explicit GridReader(const SourceText& source) : rest_(source.content()) {}

  tl::expected<HeightGrid, std::string> read() {
    std::optional<Header> header = read_header();
    if (!header) return tl::unexpected(error_);
    HeightGrid& grid = header->grid;
    grid.heights.reserve(grid.columns * grid.rows);
    for (std::size_t row = 0; row < grid.rows; ++row) {
      for (std::size_t column = 0; column < grid.columns; ++column) {
        const std::optional<double> height = read_height(*header, row, column);
        if (!height) return tl::unexpected(error_);
        const bool is_known = *height != header->no_data;
        grid.heights.push_back(is_known ? *height : std::numeric_limits<double>::quiet_NaN());
      }
    }
    if (word().empty()) return std::move(grid);
    fail(fmt::format("there are more values than {} rows of {}", grid.rows, grid.columns));
    return tl::unexpected(error_);
  }

 private:
  void fail(const std::string& what) { error_ = fmt::format("line {}: {}", line_, what); }

  // The next word; empty at the end. `line_` is that of the word.
  std::string_view word() {
    std::size_t begin = 0;
    for (; begin < rest_.size() && kBlanks.find(rest_[begin]) != std::string_view::npos; ++begin) {
      if (rest_[begin] == '\n') ++line_;
    }
    const std::size_t end = std::min(rest_.find_first_of(kBlanks, begin), rest_.size());
    const std::string_view found = rest_.substr(begin, end - begin);
    rest_.remove_prefix(end);
    return found;
  }

  std::optional<double> number(const std::string& what) {
    const std::string_view text = word();
    double value = 0.0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failed == std::errc() && end == text.data() + text.size() && std::isfinite(value)) {
      return value;
    }
    fail(text.empty() ? fmt::format("the file ends before {}", what)
                      : fmt::format("{} must be a number, not \"{}\"", what, text.substr(0, 40)));
    return std::nullopt;
  }

  std::optional<double> read_height(const Header& header, std::size_t row, std::size_t column) {
    const auto value = number(fmt::format("the value of row {}, column {}", row + 1, column + 1));
    if (!value || *value == header.no_data || is_height(*value)) return value;
    fail(
        fmt::format("{:g} is no height in metres: is it the value of cells without data? Then "
                    "write NODATA_value {:g}",
                    *value, *value));
    return std::nullopt;
  }

  std::optional<Header> read_header() {
    static constexpr std::array<std::string_view, 8> kKeys{"ncols",     "nrows",       "xllcorner",
                                                           "yllcorner", "xllcenter",   "yllcenter",
                                                           "cellsize",  "nodata_value"};
    std::array<std::optional<double>, kKeys.size()> values;
    while (true) {
      const std::string_view before = rest_;
      const int line_before = line_;
      const std::string key = lower(word());
      const auto* const known = std::ranges::find(kKeys, key);
      if (known == kKeys.end()) {
        rest_ = before;
        line_ = line_before;
        break;
      }
      const std::optional<double> value = number(key);
      if (!value) return std::nullopt;
      values[static_cast<std::size_t>(known - kKeys.begin())] = value;
    }
    const auto& [columns, rows, west, south, west_centre, south_centre, cell, no_data] = values;
    if (!columns || !rows || !cell || !(west || west_centre) || !(south || south_centre)) {
      fail("a grid begins with ncols, nrows, xllcorner, yllcorner and cellsize");
      return std::nullopt;
    }
    if (const std::string problem = grid_problem(*columns, *rows, *cell); !problem.empty()) {
      fail(problem);
      return std::nullopt;
    }
    return Header{{static_cast<std::size_t>(*columns),
                   static_cast<std::size_t>(*rows),
                   west ? *west + 0.5 * *cell : *west_centre,
                   south ? *south + 0.5 * *cell : *south_centre,
                   *cell,
                   {}},
                  no_data.value_or(-9999.0)};
  }

  std::string_view rest_;
  int line_ = 1;
  std::string error_;
};

}  // namespace

bool begins_like_grid(std::string_view head) {
  return lower(head.substr(0, 5)) == "ncols" || begins_like_tiff(head);
}

bool is_grid(const std::string& path) { return begins_like_grid(head_of(path)); }

tl::expected<TriangleMesh, std::string> read_grid(const std::string& path) {
  if (begins_like_tiff(head_of(path))) return read_geotiff(path).and_then(ground_of);
  const tl::expected<SourceText, std::string> source = read_source_text(path, kMaxGridBytes);
  if (!source) return tl::unexpected(source.error());
  return GridReader(*source).read().and_then(ground_of);
}

SourceText grid_as_map(const std::string& path) {
  const std::filesystem::path file(path);
  return {path,
          fmt::format("<?xml version=\"1.0\"?>\n"
                      "<sdf version=\"1.6\">\n"
                      "  <world name=\"{0}\">\n"
                      "    <model name=\"{0}\"><static>true</static><link name=\"ground\">\n"
                      "      <collision name=\"grid\"><geometry><mesh>\n"
                      "        <uri>{1}</uri>\n"
                      "      </mesh></geometry></collision>\n"
                      "    </link></model>\n"
                      "  </world>\n"
                      "</sdf>\n",
                      escape_xml(file.stem().string()), escape_xml(file.filename().string()))};
}

}  // namespace dive::planning
