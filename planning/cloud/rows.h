#pragma once
// What PCD and PLY have in common: points as rows of numbers, of which three are coordinates.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/se3.h"
#include "planning/cloud/input.h"

namespace dive::planning {

/// A cloud in the units of its file.
struct RawCloud {
  std::vector<Eigen::Vector3d> points;  ///< Finite.
  std::size_t dropped = 0;              ///< Those that were not.
  bool single_precision = false;        ///< Came from 4-byte floats.
  std::optional<Pose> viewpoint;
  std::vector<std::string> warnings;

  void add(const Eigen::Vector3d& point) {
    if (point.allFinite()) {
      points.push_back(point);
    } else {
      ++dropped;
    }
  }
};

struct NumberType {
  enum class Kind { kSigned, kUnsigned, kFloat };
  Kind kind = Kind::kFloat;
  std::size_t size = 4;  ///< Bytes: 1, 2, 4, 8; of a float 4 or 8.
};

/// Value of a number that lies at `bytes`, which need not be aligned.
[[nodiscard]] double decode(NumberType type, const char* bytes, bool big_endian);

struct Column {
  std::size_t word = 0;    ///< Its place in a row of text.
  std::size_t offset = 0;  ///< Its first byte in a binary row.
  NumberType type;
};

struct RowLayout {
  std::array<Column, 3> xyz;
  std::size_t words = 0;
  std::size_t bytes = 0;
  bool big_endian = false;
};

/// Rows longer than this are refused; the longest descriptors take some 10 kB.
inline constexpr std::size_t kLongestRow = std::size_t{1} << 16;
/// Of a header, bytes.
inline constexpr std::uint64_t kLongestHeader = std::uint64_t{1} << 20;

// They append `count` points. The answer is why they could not, empty where they could.
[[nodiscard]] std::string read_text_rows(Input& input, const RowLayout& layout, std::uint64_t count,
                                         RawCloud& cloud);
[[nodiscard]] std::string read_binary_rows(Input& input, const RowLayout& layout,
                                           std::uint64_t count, RawCloud& cloud);

/// For the end of the file: points that the header does not count are an error in text, where
/// nothing but points can follow, and a warning in binary, where writers pad.
[[nodiscard]] std::string expect_no_more_text(Input& input);
void warn_of_more_bytes(const Input& input, RawCloud& cloud);

/// Why a cloud of so many points is not read; empty where it is.
[[nodiscard]] std::string check_count(std::uint64_t promised, std::size_t most);

}  // namespace dive::planning
