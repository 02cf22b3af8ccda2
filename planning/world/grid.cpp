#include "planning/world/grid.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <istream>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "common/input_file.h"
#include "common/xml.h"

namespace dive::planning {
namespace {

constexpr std::size_t kMaxBytes = 16U << 20U;
constexpr double kMaxElevation = 12'000.0;  // m, of anything on earth
constexpr double kMinCell = 0.01;           // m; smaller ones are degrees
constexpr std::string_view kBlanks = " \t\r\n";

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

struct Header {
  std::size_t columns = 0;
  std::size_t rows = 0;
  double west = 0.0;  // x of the centres of the first column
  double south = 0.0;
  double cell = 0.0;
  double no_data = -9999.0;
};

class GridReader {
 public:
  explicit GridReader(const SourceText& source) : rest_(source.content()) {}

  tl::expected<TriangleMesh, std::string> read() {
    const std::optional<Header> header = read_header();
    if (!header) return tl::unexpected(error_);
    TriangleMesh mesh;
    mesh.vertices.reserve(header->columns * header->rows);
    bool has_data = false;
    for (std::size_t row = 0; row < header->rows; ++row) {
      const double y = header->south + static_cast<double>(header->rows - 1 - row) * header->cell;
      for (std::size_t column = 0; column < header->columns; ++column) {
        const std::optional<double> height = read_height(*header, row, column);
        if (!height) return tl::unexpected(error_);
        has_data = has_data || *height != header->no_data;
        const double x = header->west + static_cast<double>(column) * header->cell;
        mesh.vertices.emplace_back(x, y, *height == header->no_data ? 0.0 : *height);
      }
    }
    if (!word().empty()) {
      fail(fmt::format("there are more values than {} rows of {}", header->rows, header->columns));
      return tl::unexpected(error_);
    }
    if (!has_data) return tl::unexpected(std::string("no cell of the grid has data"));
    add_triangles(*header, mesh);
    return mesh;
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
    if (!value || *value == header.no_data || std::abs(*value) <= kMaxElevation) return value;
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
    return checked(
        *columns, *rows, *cell,
        Header{0, 0, west ? *west + 0.5 * *cell : *west_centre,
               south ? *south + 0.5 * *cell : *south_centre, *cell, no_data.value_or(-9999.0)});
  }

  std::optional<Header> checked(double columns, double rows, double cell, Header header) {
    const auto is_count = [](double value) {
      return value >= 2.0 && value <= static_cast<double>(kMaxGridCells) &&
             value == std::floor(value);
    };
    if (!is_count(columns) || !is_count(rows)) {
      fail("ncols and nrows must be whole numbers of at least 2");
    } else if (columns * rows > static_cast<double>(kMaxGridCells)) {
      fail(
          fmt::format("the grid has {:.0f} cells, and {} can be handled: cut out the area of the "
                      "dive, or use larger cells",
                      columns * rows, kMaxGridCells));
    } else if (!(cell >= kMinCell)) {
      fail(
          fmt::format("a cell size of {:g} is in degrees: project the grid to metres about the "
                      "origin, as with gdalwarp -t_srs \"+proj=ortho +lat_0=... +lon_0=...\"",
                      cell));
    } else {
      header.columns = static_cast<std::size_t>(columns);
      header.rows = static_cast<std::size_t>(rows);
      return header;
    }
    return std::nullopt;
  }

  // Counter-clockwise from above; rows go south.
  static void add_triangles(const Header& header, TriangleMesh& mesh) {
    const auto at = [&](std::size_t row, std::size_t column) {
      return static_cast<std::uint32_t>(row * header.columns + column);
    };
    for (std::size_t row = 0; row + 1 < header.rows; ++row) {
      for (std::size_t column = 0; column + 1 < header.columns; ++column) {
        const std::uint32_t north_west = at(row, column);
        const std::uint32_t north_east = at(row, column + 1);
        const std::uint32_t south_west = at(row + 1, column);
        const std::uint32_t south_east = at(row + 1, column + 1);
        mesh.triangles.push_back({north_west, south_west, north_east});
        mesh.triangles.push_back({north_east, south_west, south_east});
      }
    }
  }

  std::string_view rest_;
  int line_ = 1;
  std::string error_;
};

}  // namespace

bool is_grid(const std::string& path) {
  const auto file = open_input_stream(path);
  if (!file) return false;
  std::string key;
  **file >> std::setw(16) >> key;  // of a file without blanks not all
  return lower(key.substr(0, 8)) == "ncols";
}

tl::expected<TriangleMesh, std::string> read_grid(const std::string& path) {
  const tl::expected<SourceText, std::string> source = read_source_text(path, kMaxBytes);
  if (!source) return tl::unexpected(source.error());
  return GridReader(*source).read();
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
