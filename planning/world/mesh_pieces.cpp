#include "planning/world/mesh_pieces.h"

#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "common/fnv.h"

namespace dive::planning {
namespace {

constexpr std::string_view kMagic = "dive-mesh-pieces 2";
constexpr double kUnit = 1e-6;               // m
constexpr std::int64_t kMaxCount = 1 << 20;  // limit of pieces, and of the corners of one

std::int64_t to_units(double metres) { return std::llround(metres / kUnit); }

std::uint64_t digest_of(std::string_view text) {
  Fnv1a64 digest;
  digest.add(text);
  return digest.value();
}

// Reads the output of to_text() word by word; after the first error every read fails.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::string_view rest() const { return text_; }

  std::string_view line() {
    const std::size_t end = text_.find('\n');
    good_ = good_ && end != std::string_view::npos;
    if (!good_) return {};
    const std::string_view result = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    return result;
  }
  void expect(std::string_view word) {
    good_ = good_ && text_.starts_with(word);
    if (good_) text_.remove_prefix(word.size());
  }
  template <class T>
  T number(int base = 10) {
    T value{};
    std::from_chars_result got{};
    if constexpr (std::is_floating_point_v<T>) {
      got = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    } else {
      got = std::from_chars(text_.data(), text_.data() + text_.size(), value, base);
    }
    good_ = good_ && got.ec == std::errc{};
    if (!good_) return {};
    text_.remove_prefix(static_cast<std::size_t>(got.ptr - text_.data()));
    return value;
  }
  std::int64_t count() {
    const auto value = number<std::int64_t>();
    good_ = good_ && value >= 1 && value <= kMaxCount;
    return good_ ? value : 0;
  }
  double metres() { return static_cast<double>(number<std::int64_t>()) * kUnit; }

 private:
  std::string_view text_;
  bool good_ = true;
};

}  // namespace

std::string to_text(const MeshPieces& mesh) {
  const auto& [uri, scale, digest] = mesh.key;
  std::string text =
      fmt::format("{}\n{}\nfile {:016x} scale {} {} {} tolerance {}\npieces {}\n", kMagic, uri,
                  digest, scale.x(), scale.y(), scale.z(), mesh.tolerance, mesh.pieces.size());
  auto out = std::back_inserter(text);
  for (const Polytope& piece : mesh.pieces) {
    // Rounding moves a corner by up to half a unit along each axis, which is 0.87 units in all.
    const auto radius = static_cast<std::int64_t>(std::ceil(piece.radius / kUnit)) + 1;
    fmt::format_to(out, "{} {}", radius, piece.vertices.size());
    for (const Eigen::Vector3d& v : piece.vertices) {
      fmt::format_to(out, " {} {} {}", to_units(v.x()), to_units(v.y()), to_units(v.z()));
    }
    fmt::format_to(out, "\n");
  }
  fmt::format_to(out, "end {:016x}\n", digest_of(text));
  return text;
}

std::optional<MeshPieces> take_mesh_pieces(std::string_view& text) {
  Words words(text);
  MeshPieces mesh;
  if (words.line() != kMagic) return std::nullopt;
  mesh.key.uri = words.line();
  words.expect("file ");
  mesh.key.digest = words.number<std::uint64_t>(16);
  words.expect(" scale");
  for (double& factor : mesh.key.scale) {
    words.expect(" ");
    factor = words.number<double>();
  }
  words.expect(" tolerance ");
  mesh.tolerance = words.number<double>();
  words.expect("\npieces ");
  for (std::int64_t left = words.count(); left > 0 && words.good(); --left) {
    words.expect("\n");
    Polytope piece;
    piece.radius = words.metres();
    words.expect(" ");
    for (std::int64_t corners = words.count(); corners > 0 && words.good(); --corners) {
      Eigen::Vector3d& v = piece.vertices.emplace_back();
      for (double& x : v) {
        words.expect(" ");
        x = words.metres();
      }
    }
    mesh.pieces.push_back(std::move(piece));
  }
  words.expect("\n");
  if (!words.good()) return std::nullopt;
  const std::uint64_t expected =
      digest_of(text.substr(0, static_cast<std::size_t>(words.rest().data() - text.data())));
  words.expect("end ");
  const bool is_whole = words.number<std::uint64_t>(16) == expected;
  words.expect("\n");
  if (!words.good() || !is_whole) return std::nullopt;
  text = words.rest();
  return mesh;
}

}  // namespace dive::planning
