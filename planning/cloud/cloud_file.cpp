#include "planning/cloud/cloud_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "planning/cloud/input.h"
#include "planning/cloud/pcd.h"
#include "planning/cloud/ply.h"
#include "planning/cloud/rows.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kMaxCoordinate = 1e8;  // m
constexpr double kNearZero = 1000.0;    // m
constexpr double kFineEnough = 0.01;    // m between neighbouring numbers
constexpr std::size_t kHeadBytes = 4096;
constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

bool is_octomap(std::string_view head) {
  if (head.starts_with("# Octomap OcTree")) return true;
  // The older format, without a text header: type of the tree, its resolution, its size.
  std::int32_t type = 0;
  double resolution = 0.0;
  if (head.size() < sizeof(type) + sizeof(resolution)) return false;
  std::memcpy(&type, head.data(), sizeof(type));
  std::memcpy(&resolution, head.data() + sizeof(type), sizeof(resolution));
  return type == 3 && resolution > 1e-4 && resolution < 1e3;
}

std::string seems_to_be(std::string_view head) {
  using namespace std::string_view_literals;
  struct Known {
    std::string_view start;
    std::string_view what;
  };
  static constexpr Known kKnown[] = {
      {"version https://git-lfs.github.com/",
       "a Git LFS pointer in place of the file; `git lfs pull` fetches it"},
      {"LASF", "a LAS or LAZ scan; convert it to PCD or PLY"},
      {"ASTM-E57", "an E57 scan; convert it to PCD or PLY"},
      {"solid ", "an STL mesh"},
      {"\x1f\x8b", "compressed with gzip; unpack it first"},
      {"PK\x03\x04", "a zip archive; unpack it first"},
      {"\x89HDF", "an HDF5 file"},
      {"CDF", "a NetCDF file"},
      {"<", "XML or HTML"},
      {"{", "JSON"},
  };
  if (is_octomap(head)) return "an OctoMap tree; convert it to PCD";
  for (const Known& known : kKnown) {
    if (head.starts_with(known.start)) return std::string(known.what);
  }
  if (head.find_first_not_of('\0') == std::string_view::npos) return "nothing but zeros";
  const bool is_text = std::none_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);  // char is unsigned on aarch64
    return (byte < ' ' && "\t\n\v\f\r"sv.find(c) == std::string_view::npos) || byte == 127;
  });
  if (!is_text) return "binary data of another kind";
  std::string_view line = head.substr(0, head.find('\n'));
  if (std::count(line.begin(), line.end(), ',') >= 2) {
    return "a table with commas (csv); convert it to PCD or PLY";
  }
  if (to_number(take_word(line)) && to_number(take_word(line)) && to_number(take_word(line))) {
    return "rows of numbers without a header; convert it to PCD or PLY";
  }
  return "text of another kind";
}

tl::expected<RawCloud, std::string> read_raw(const std::string& path, std::size_t max_points) {
  auto input = Input::open(path);
  if (!input) return tl::unexpected(std::move(input.error()));
  const std::string_view head = input->peek(kHeadBytes);
  if (head.empty()) return tl::unexpected(std::string("it cannot be read"));
  if (looks_like_pcd(head)) return read_pcd(*input, max_points);
  if (looks_like_ply(head)) return read_ply(*input, max_points);
  return tl::unexpected("it is neither PCD nor PLY; it seems to be " + seems_to_be(head));
}

// The rule is documented at CloudOptions::unit_m.
bool looks_like_millimetres(const std::vector<Vector3d>& points) {
  Vector3d low = points.front();
  Vector3d high = low;
  std::size_t whole = 0;
  for (const Vector3d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    if (p.z() == std::floor(p.z())) ++whole;
  }
  const double largest = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  const Vector3d extent = high - low;
  return points.size() >= 10 && largest <= 65535.0 && extent.maxCoeff() > 500.0 &&
         extent.z() > 100.0 && whole >= points.size() - points.size() / 100;
}

double median(const std::vector<Vector3d>& points, Eigen::Index axis) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const Vector3d& p : points) values.push_back(p[axis]);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Distance from |value| to the next number that a 4-byte float can represent.
double float_spacing(double value) {
  const auto near = static_cast<float>(std::abs(value));
  return static_cast<double>(std::nextafter(near, std::numeric_limits<float>::infinity())) -
         static_cast<double>(near);
}

std::uint64_t hash_of(const Vector3f& p) {
  std::uint64_t hash = 0;
  for (const float value : p) {
    // Adding zero makes -0 the same as +0, which it equals.
    hash = (hash ^ std::bit_cast<std::uint32_t>(value + 0.0F)) * 0x9E3779B97F4A7C15ULL;
    hash ^= hash >> 29;
  }
  hash *= 0xBF58476D1CE4E5B9ULL;
  return hash ^ (hash >> 32);
}

// Keeps the first of equal points, in their order; returns the number removed.
std::size_t drop_duplicates(std::vector<Vector3f>& points) {
  const std::size_t slots = std::bit_ceil(2 * points.size());
  std::vector<std::uint32_t> table(slots, kNobody);
  std::size_t kept = 0;
  for (const Vector3f& point : points) {
    std::size_t slot = hash_of(point) & (slots - 1);
    while (table[slot] != kNobody && points[table[slot]] != point) slot = (slot + 1) & (slots - 1);
    if (table[slot] != kNobody) continue;
    table[slot] = static_cast<std::uint32_t>(kept);
    points[kept++] = point;
  }
  const std::size_t gone = points.size() - kept;
  points.resize(kept);
  return gone;
}

void choose_unit(const std::vector<Vector3d>& points, const CloudOptions& options,
                 CloudFile& cloud) {
  if (options.unit_m) {
    cloud.unit_m = *options.unit_m;
  } else if (looks_like_millimetres(points)) {
    cloud.unit_m = 0.001;
    cloud.warnings.emplace_back(
        "no unit is given; guessed from whole numbers in z and an extent of more than 500: "
        "millimetres");
  } else {
    cloud.warnings.emplace_back("no unit is given; taken to be metres");
  }
}

void to_metres(std::vector<Vector3d>& points, CloudFile& cloud) {
  for (Vector3d& p : points) p *= cloud.unit_m;
  const std::size_t far = std::erase_if(
      points, [](const Vector3d& p) { return !(p.cwiseAbs().maxCoeff() <= kMaxCoordinate); });
  if (far > 0) {
    cloud.warnings.push_back(fmt::format(
        "{} points are farther than {:.0e} m from zero and dropped", far, kMaxCoordinate));
  }
  cloud.dropped += far;
}

void choose_origin(const std::vector<Vector3d>& points, bool single_precision, CloudFile& cloud) {
  double lost = 0.0;
  double spacing = 0.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double middle = median(points, axis);
    lost = std::max(lost, float_spacing(middle / cloud.unit_m) * cloud.unit_m);
    if (std::abs(middle) > kNearZero) cloud.origin[axis] = std::round(middle);
    for (const Vector3d& p : points) {
      spacing = std::max(spacing, std::abs(p[axis] - cloud.origin[axis]));
    }
  }
  spacing = float_spacing(spacing);
  if (single_precision && lost > kFineEnough) {
    cloud.warnings.push_back(fmt::format(
        "its coordinates are 4-byte floats so large that they come in steps of {:.2g} m: what was "
        "finer had been lost before",
        lost));
  }
  if (spacing > kFineEnough) {
    cloud.warnings.push_back(
        fmt::format("it reaches so far that its outermost points are held to {:.2g} m", spacing));
  }
}

tl::expected<CloudFile, std::string> finish(RawCloud raw, const CloudOptions& options) {
  CloudFile cloud;
  cloud.dropped = raw.dropped;
  cloud.warnings = std::move(raw.warnings);
  if (!raw.points.empty()) {
    choose_unit(raw.points, options, cloud);
    to_metres(raw.points, cloud);
  }
  if (raw.points.empty()) {
    return tl::unexpected(fmt::format("none of its {} points is a finite one", cloud.dropped));
  }
  choose_origin(raw.points, raw.single_precision, cloud);
  cloud.points.reserve(raw.points.size());
  for (const Vector3d& p : raw.points) {
    cloud.points.emplace_back((p - cloud.origin).cast<float>());
  }
  raw.points = {};
  cloud.duplicates = drop_duplicates(cloud.points);
  cloud.viewpoint = raw.viewpoint;
  if (cloud.viewpoint) cloud.viewpoint->p *= cloud.unit_m;
  return cloud;
}

}  // namespace

bool begins_like_cloud(std::string_view head) {
  return looks_like_pcd(head) || looks_like_ply(head);
}

tl::expected<CloudFile, std::string> read_cloud(const std::string& path,
                                                const CloudOptions& options) {
  if (options.unit_m && !(*options.unit_m >= 1e-9 && *options.unit_m <= 1e9)) {
    return tl::unexpected(fmt::format("{} m is no unit of length", *options.unit_m));
  }
  const std::size_t max_points = std::min<std::size_t>(options.max_points, kNobody - 1);
  try {
    auto raw = read_raw(path, max_points);
    if (!raw) return tl::unexpected(std::move(raw.error()));
    return finish(std::move(*raw), options);
  } catch (const std::bad_alloc&) {
    return tl::unexpected(std::string("there is not enough memory for it"));
  } catch (const std::exception& error) {
    return tl::unexpected(std::string(error.what()));
  }
}

std::string to_ply(const std::vector<Vector3f>& points, const std::vector<std::string>& comments) {
  static_assert(sizeof(Vector3f) == 3 * sizeof(float));
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  for (std::string comment : comments) {
    std::replace_if(
        comment.begin(), comment.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    text += "comment " + comment + '\n';
  }
  text += fmt::format(
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
      points.size());
  text.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Vector3f));
  return text;
}

}  // namespace dive::planning
