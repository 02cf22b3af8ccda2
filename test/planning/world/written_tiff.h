#pragma once
// Small GeoTIFFs, written byte by byte.

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace dive::testing {

template <class Value>
std::string bytes_of(const std::vector<Value>& values) {
  std::string bytes(values.size() * sizeof(Value), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

// A TIFF of one strip of 32-bit numbers, in the byte order of this computer (little-endian).
struct Tiff {
  enum Type : std::uint16_t { kAscii = 2, kShort = 3, kLong = 4, kDouble = 12 };
  struct Field {
    Type type;
    std::uint32_t count;
    std::string bytes;
  };
  std::map<std::uint16_t, Field> fields;  // by tag, which TIFF orders
  std::vector<float> values;

  void shorts(std::uint16_t tag, const std::vector<std::uint16_t>& v) {
    fields[tag] = {kShort, static_cast<std::uint32_t>(v.size()), bytes_of(v)};
  }
  void longs(std::uint16_t tag, const std::vector<std::uint32_t>& v) {
    fields[tag] = {kLong, static_cast<std::uint32_t>(v.size()), bytes_of(v)};
  }
  void doubles(std::uint16_t tag, const std::vector<double>& v) {
    fields[tag] = {kDouble, static_cast<std::uint32_t>(v.size()), bytes_of(v)};
  }
  void text(std::uint16_t tag, const std::string& v) {
    fields[tag] = {kAscii, static_cast<std::uint32_t>(v.size() + 1), v + '\0'};
  }
  // An EPSG code: 1 projected, 2 geographic; 1 the place of a cell is its area, 2 its centre.
  void projection(std::uint16_t model, std::uint16_t code, std::uint16_t raster = 1) {
    const std::uint16_t key = model == 1 ? 3072 : 2048;
    shorts(34735, {1, 1, 0, 3, 1024, 0, 1, model, 1025, 0, 1, raster, key, 0, 1, code});
  }

  std::string bytes() const {
    const std::size_t directory = 8;
    std::size_t end = directory + 2 + 12 * fields.size() + 4;
    std::string entries =
        bytes_of(std::vector<std::uint16_t>{static_cast<std::uint16_t>(fields.size())});
    std::string rest;
    const std::string strip = bytes_of(values);
    for (const auto& [tag, field] : fields) {
      entries += bytes_of(std::vector<std::uint16_t>{tag, field.type});
      entries += bytes_of(std::vector<std::uint32_t>{field.count});
      if (tag == 273) {  // the strip comes last, after fields of this size
        std::size_t size = end;
        for (const auto& [other, f] : fields) size += f.bytes.size() > 4 ? f.bytes.size() : 0;
        entries += bytes_of(std::vector<std::uint32_t>{static_cast<std::uint32_t>(size)});
      } else if (field.bytes.size() > 4) {
        entries +=
            bytes_of(std::vector<std::uint32_t>{static_cast<std::uint32_t>(end + rest.size())});
        rest += field.bytes;
      } else {
        entries += field.bytes + std::string(4 - field.bytes.size(), '\0');
      }
    }
    entries += std::string(4, '\0');
    return std::string("II*\0\x08\0\0\0", 8) + entries + rest + strip;
  }
};

// Cells of 2 m; the north-west corner of the first is at x = -10, y = 8. UTM zone 20 N.
inline Tiff tiff(std::uint32_t columns, std::uint32_t rows, std::vector<float> values) {
  Tiff made;
  made.values = std::move(values);
  made.longs(256, {columns});
  made.longs(257, {rows});
  made.shorts(258, {32});
  made.shorts(259, {1});
  made.shorts(262, {1});
  made.longs(273, {0});
  made.shorts(277, {1});
  made.longs(278, {rows});
  made.longs(279, {4 * columns * rows});
  made.shorts(339, {3});  // floating point
  made.doubles(33550, {2.0, 2.0, 0.0});
  made.doubles(33922, {0.0, 0.0, 0.0, -10.0, 8.0, 0.0});
  made.projection(1, 32620);
  return made;
}

}  // namespace dive::testing
