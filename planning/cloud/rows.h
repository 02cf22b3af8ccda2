#pragma once
// The common part of PCD and PLY: points as rows of numbers, of which three are coordinates.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "common/se3.h"
#include "planning/cloud/input.h"

namespace dive::planning {

/// A cloud in the units of its file.
struct RawCloud {
  std::vector<Eigen::Vector3d> points;  ///< Finite points, in units of the file.
  std::size_t dropped = 0;              ///< Number of points that were not finite.
  bool single_precision = false;        ///< True if the coordinates were 4-byte floats.
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
  std::size_t size = 4;  ///< Size in bytes: 1, 2, 4, 8; for a float 4 or 8.
};

/// Value of the number at `bytes`, which need not be aligned.
[[nodiscard]] double decode(NumberType type, const char* bytes, bool big_endian);

struct Column {
  std::size_t word = 0;    ///< Index of the word in a row of text.
  std::size_t offset = 0;  ///< Offset of the first byte in a binary row.
  NumberType type;
};

struct RowLayout {
  std::array<Column, 3> xyz;
  std::size_t words = 0;
  std::size_t bytes = 0;
  bool big_endian = false;
};

/// Longest accepted row, bytes; the longest descriptors take some 10 kB.
inline constexpr std::size_t kMaxRowLength = std::size_t{1} << 16;
/// Longest accepted header, bytes.
inline constexpr std::uint64_t kMaxHeaderLength = std::uint64_t{1} << 20;

// Both append `count` points and return the reason for a failure, empty on success.
[[nodiscard]] std::string read_text_rows(Input& input, const RowLayout& layout, std::uint64_t count,
                                         RawCloud& cloud);
[[nodiscard]] std::string read_binary_rows(Input& input, const RowLayout& layout,
                                           std::uint64_t count, RawCloud& cloud);

/// Checks the end of the file. Points beyond the header's count are an error in text, where only
/// points can follow, and a warning in binary, where writers pad.
[[nodiscard]] std::string expect_no_more_text(Input& input);
void warn_of_more_bytes(const Input& input, RawCloud& cloud);

[[nodiscard]] inline tl::unexpected<std::string> refuse(std::string reason) {
  return tl::unexpected(std::move(reason));
}

/// The reason to refuse a cloud of that many points; empty if it is accepted.
[[nodiscard]] std::string check_count(std::uint64_t promised, std::size_t most);

}  // namespace dive::planning
