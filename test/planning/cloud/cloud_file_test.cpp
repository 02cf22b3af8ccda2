#include "planning/cloud/cloud_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <liblzf/lzf.h>
#include <unistd.h>

#include "test/common/allocations.h"
#include "test/common/file_content.h"

namespace dive::planning {
namespace {

namespace fs = std::filesystem;
using dive::testing::content_of;
using Eigen::Vector3d;
using Eigen::Vector3f;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const CloudOptions kMetres{.unit_m = 1.0};

/// One file in a temporary folder of its own.
class Scratch {
 public:
  Scratch() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Scratch() { fs::remove_all(folder_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  [[nodiscard]] fs::path folder() const { return folder_; }
  [[nodiscard]] std::string with(const std::string& content) const {
    std::ofstream(path(), std::ios::binary) << content;
    return path().string();
  }
  [[nodiscard]] fs::path path() const { return folder_ / "cloud"; }

 private:
  fs::path folder_ = fs::temp_directory_path() /
                     fmt::format("dive_cloud_{}_{}", getpid(),
                                 ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

template <class T>
std::string bytes_of(T value, bool big_endian = false) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

/// A number in the types of PCD's TYPE and SIZE, or of PLY.
std::string bytes_of(double value, const std::string& type, bool big_endian = false) {
  const auto whole = static_cast<std::int64_t>(std::isfinite(value) ? value : 0.0);
  if (type == "F4" || type == "float") return bytes_of(static_cast<float>(value), big_endian);
  if (type == "F8" || type == "double") return bytes_of(value, big_endian);
  if (type == "I1" || type == "char") return bytes_of(static_cast<std::int8_t>(whole), big_endian);
  if (type == "U1" || type == "uchar") {
    return bytes_of(static_cast<std::uint8_t>(whole), big_endian);
  }
  if (type == "I2" || type == "short") {
    return bytes_of(static_cast<std::int16_t>(whole), big_endian);
  }
  if (type == "U2" || type == "ushort") {
    return bytes_of(static_cast<std::uint16_t>(whole), big_endian);
  }
  if (type == "I4" || type == "int") return bytes_of(static_cast<std::int32_t>(whole), big_endian);
  if (type == "U4" || type == "uint") {
    return bytes_of(static_cast<std::uint32_t>(whole), big_endian);
  }
  if (type == "I8") return bytes_of(whole, big_endian);
  return bytes_of(static_cast<std::uint64_t>(whole), big_endian);
}

std::string packed(const std::string& data) {
  std::string result(data.size() * 2 + 64, '\0');
  const unsigned size = lzf_compress(data.data(), static_cast<unsigned>(data.size()), result.data(),
                                     static_cast<unsigned>(result.size()));
  result.resize(size);
  return bytes_of(static_cast<std::uint32_t>(size)) +
         bytes_of(static_cast<std::uint32_t>(data.size())) + result;
}

/// Fields "label z normal x y": out of order, of any type, one of them with three numbers.
std::string pcd(const std::vector<Vector3d>& points, const std::string& encoding,
                const std::string& type = "F4", const std::string& extra = "") {
  std::string text = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS label z normal x y\n"
      "SIZE 1 {0} 4 {0} {0}\nTYPE U {1} F {1} {1}\nCOUNT 1 1 3 1 1\nWIDTH {2}\nHEIGHT 1\n{3}"
      "POINTS {2}\nDATA {4}\n",
      type[1], type[0], points.size(), extra, encoding);
  const std::string normal = bytes_of(0.5F) + bytes_of(0.25F) + bytes_of(7e30F);
  if (encoding == "ascii") {
    for (const Vector3d& p : points) {
      text += fmt::format("7 {} 0.5 0.25 7e30 {} {}\n", p.z(), p.x(), p.y());
    }
  } else if (encoding == "binary") {
    for (const Vector3d& p : points) {
      text += bytes_of(std::uint8_t{7}) + bytes_of(p.z(), type) + normal + bytes_of(p.x(), type) +
              bytes_of(p.y(), type);
    }
  } else {
    std::string columns(points.size(), '\7');
    for (const Vector3d& p : points) columns += bytes_of(p.z(), type);
    for (std::size_t i = 0; i < points.size(); ++i) columns += normal;
    for (const Vector3d& p : points) columns += bytes_of(p.x(), type);
    for (const Vector3d& p : points) columns += bytes_of(p.y(), type);
    text += packed(columns);
  }
  return text;
}

/// Properties "uchar red, T y, T x, short id, T z", after an element to be skipped.
std::string ply(const std::vector<Vector3d>& points, const std::string& encoding,
                const std::string& type = "float", const std::string& after = "") {
  std::string text = fmt::format(
      "ply\nformat {0} 1.0\ncomment made by hand\nelement camera 2\nproperty double view\n"
      "element vertex {1}\nproperty uchar red\nproperty {2} y\nproperty {2} x\nproperty short id\n"
      "property {2} z\n{3}end_header\n",
      encoding, points.size(), type, after);
  const bool big = encoding == "binary_big_endian";
  if (encoding == "ascii") {
    text += "1.5\n2.5\n";
    for (const Vector3d& p : points) {
      text += fmt::format("255 {} {} -3 {}\n", p.y(), p.x(), p.z());
    }
  } else {
    text += bytes_of(1.5, big) + bytes_of(2.5, big);
    for (const Vector3d& p : points) {
      text += "\xff" + bytes_of(p.y(), type, big) + bytes_of(p.x(), type, big) +
              bytes_of(std::int16_t{-3}, big) + bytes_of(p.z(), type, big);
    }
  }
  return text;
}

void expect_points(const tl::expected<CloudFile, std::string>& cloud,
                   const std::vector<Vector3d>& expected, const std::string& what) {
  ASSERT_TRUE(cloud) << what << ": " << cloud.error();
  ASSERT_EQ(cloud->points.size(), expected.size()) << what;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Vector3d got = cloud->origin + cloud->points[i].cast<double>();
    EXPECT_LT((got - expected[i]).norm(), 1e-4) << what << ", point " << i;
  }
}

const std::vector<Vector3d> kSome = {{1, 2, 3}, {-4, 50, 6}, {100, -8, 0}, {1, 2, 4}};

TEST(Pcd, EveryEncodingAndTypeOfNumber) {
  const Scratch scratch;
  for (const char* encoding : {"ascii", "binary", "binary_compressed"}) {
    for (const char* type : {"F4", "F8", "I1", "I2", "I4", "I8", "U1", "U2", "U4", "U8"}) {
      std::vector<Vector3d> points = kSome;
      for (Vector3d& p : points) {
        if (type[0] == 'U') p = p.cwiseAbs();
        if (type[0] == 'F') p *= 0.37;
      }
      const auto cloud = read_cloud(scratch.with(pcd(points, encoding, type)), kMetres);
      expect_points(cloud, points, fmt::format("{} {}", encoding, type));
      EXPECT_THAT(cloud->warnings, IsEmpty());
      EXPECT_EQ(cloud->origin, Vector3d(0, 0, 0));
    }
  }
}

TEST(Pcd, OldHeadersAndWindowsLinesAreRead) {
  const Scratch scratch;
  const std::string old =
      "# .PCD v.5\nVERSION .5\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 2\n"
      "DATA ascii\n1 2 3\n-4 50 6\n\n100 -8 0\n1 2 4";
  expect_points(read_cloud(scratch.with(old), kMetres), kSome, "no COUNT, VIEWPOINT, POINTS");
  std::string windows;
  for (const char c : old) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_points(read_cloud(scratch.with(windows), kMetres), kSome, "CRLF");
}

TEST(Pcd, TheViewpointIsTheSensorsPose) {
  const Scratch scratch;
  // w x y z: rotation by pi about z
  const std::string viewpoint = "VIEWPOINT 1000 2000 -3000 0 0 0 1\n";
  const auto cloud =
      read_cloud(scratch.with(pcd(kSome, "ascii", "F4", viewpoint)), {.unit_m = 0.001});
  ASSERT_TRUE(cloud) << cloud.error();
  ASSERT_TRUE(cloud->viewpoint);
  EXPECT_LT((*cloud->viewpoint * Vector3d(1, 0, 0) - Vector3d(0, 2, -3)).norm(), 1e-12);

  const auto bent =
      read_cloud(scratch.with(pcd(kSome, "ascii", "F4", "VIEWPOINT 0 0 0 0 0 0 0\n")), kMetres);
  ASSERT_TRUE(bent) << bent.error();
  EXPECT_FALSE(bent->viewpoint);
  EXPECT_THAT(bent->warnings, Contains(HasSubstr("VIEWPOINT is left out")));
}

TEST(Ply, EveryEncodingAndTypeOfNumber) {
  const Scratch scratch;
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const char* type : {"float", "double", "char", "short", "int"}) {
      const auto cloud = read_cloud(scratch.with(ply(kSome, encoding, type)), kMetres);
      expect_points(cloud, kSome, fmt::format("{} {}", encoding, type));
      EXPECT_THAT(cloud->warnings, IsEmpty());
    }
  }
}

TEST(Ply, OfAMeshTheCornersAndAWarning) {
  const Scratch scratch;
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  const auto cloud =
      read_cloud(scratch.with(ply(kSome, "ascii", "float", faces) + "3 0 1 2\n"), kMetres);
  expect_points(cloud, kSome, "mesh");
  EXPECT_THAT(cloud->warnings, Contains(HasSubstr("1 of its element face are left out")));
}

TEST(Cloud, WhatIsNotFiniteAndWhatIsThereTwiceIsDroppedAndCounted) {
  const Scratch scratch;
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<Vector3d> points = {{1, 2, 3},   {kNan, 2, 3}, {0.0, 5, 6},  {1, 2, 3},
                                        {1, inf, 3}, {-0.0, 5, 6}, {1, 2, -inf}, {1, 2, 4}};
  for (const char* encoding : {"ascii", "binary", "binary_compressed"}) {
    const auto cloud = read_cloud(scratch.with(pcd(points, encoding)), kMetres);
    expect_points(cloud, {{1, 2, 3}, {0, 5, 6}, {1, 2, 4}}, encoding);
    EXPECT_EQ(cloud->dropped, 3U);
    EXPECT_EQ(cloud->duplicates, 2U);
  }
  const auto none = read_cloud(scratch.with(pcd({{kNan, kNan, kNan}}, "binary")), {});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error(), HasSubstr("none of its 1 points"));
  // Some files use 3e38 for a missing value: it must not move the origin.
  const auto far = read_cloud(scratch.with(pcd({{1, 2, 3}, {3e38, 0, 0}}, "binary")), kMetres);
  expect_points(far, {{1, 2, 3}}, "far");
  EXPECT_EQ(far->dropped, 1U);
  EXPECT_THAT(far->warnings, Contains(HasSubstr("1 points are farther than")));
}

TEST(Cloud, CentimetresSurviveInUtm) {
  const Scratch scratch;
  std::vector<Vector3d> points;
  for (int i = 0; i < 1000; ++i) {
    points.emplace_back(500'000.0 + 0.01 * i, 4'000'000.0 + 0.01 * ((7 * i) % 1000), -20.0);
  }
  points.emplace_back(0, 0, 0);  // Some writers use zeros where there was no echo.
  for (const std::string& content :
       {pcd(points, "ascii"), pcd(points, "binary", "F8"), pcd(points, "binary_compressed", "F8"),
        ply(points, "ascii", "double"), ply(points, "binary_big_endian", "double")}) {
    const auto cloud = read_cloud(scratch.with(content), kMetres);
    ASSERT_TRUE(cloud) << cloud.error();
    ASSERT_EQ(cloud->points.size(), 1001U);
    EXPECT_EQ(cloud->duplicates, 0U);
    EXPECT_EQ(cloud->origin, cloud->origin.array().round().matrix());
    EXPECT_EQ(cloud->origin.z(), 0.0);
    for (std::size_t i = 0; i < 1000; ++i) {
      const Vector3d got = cloud->origin + cloud->points[i].cast<double>();
      EXPECT_LT((got - points[i]).norm(), 1e-5) << i;
    }
  }
  points.pop_back();
  const auto coarse = read_cloud(scratch.with(pcd(points, "binary", "F4")), kMetres);
  ASSERT_TRUE(coarse) << coarse.error();
  EXPECT_THAT(coarse->warnings, Contains(HasSubstr("steps of 0.25 m")));
}

TEST(Cloud, MillimetresAreGuessedWithAWarningAndOnlyThen) {
  const Scratch scratch;
  const auto grid = [](double unit, double offset) {
    std::vector<Vector3d> points;
    for (int i = 0; i < 400; ++i) {  // A depth camera: z in whole numbers, x and y not.
      const double z = 800.0 + i;
      const Vector3d p(z * (i % 20 - 10) / 31.0, z * (i / 20 - 10) / 31.0, z);
      points.push_back((p + Vector3d(0, 0, offset)) * unit);
    }
    return points;
  };
  const auto depth = read_cloud(scratch.with(pcd(grid(1, 0), "binary")), {});
  expect_points(depth, grid(0.001, 0), "millimetres");
  EXPECT_EQ(depth->unit_m, 0.001);
  EXPECT_THAT(depth->warnings, Contains(HasSubstr("millimetres")));

  const auto scaled = read_cloud(scratch.with(pcd(grid(1, 0), "binary")), kMetres);
  expect_points(scaled, grid(1, 0), "in the unit given");
  EXPECT_THAT(scaled->warnings, IsEmpty());

  // A lake in metres is as wide, but none of its depths is a whole number.
  const auto lake = read_cloud(scratch.with(pcd(grid(1, 0.37), "binary")), {});
  expect_points(lake, grid(1, 0.37), "metres");
  EXPECT_THAT(lake->warnings, Contains(HasSubstr("taken to be metres")));

  for (const double unit : {0.0, -1.0, kNan, 1e300}) {
    EXPECT_FALSE(read_cloud(scratch.with(pcd(kSome, "ascii")), {.unit_m = unit})) << unit;
  }
}

struct Bad {
  std::string content;
  std::string reason;
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

TEST(Cloud, WhatCannotBeReadIsRefusedWithItsReasonAndWithoutMemory) {
  const Scratch scratch;
  const std::string text = pcd(kSome, "ascii");
  const std::string binary = pcd(kSome, "binary");
  const std::string lzf = pcd(kSome, "binary_compressed");
  const std::size_t lzf_start = lzf.find("binary_compressed\n") + 18;
  const std::string vertices = ply(kSome, "binary_little_endian");
  const auto with_sizes = [&](std::uint32_t small, std::uint32_t large) {
    return lzf.substr(0, lzf_start) + bytes_of(small) + bytes_of(large) + lzf.substr(lzf_start + 8);
  };
  const auto with_count = [](const std::string& content, const std::string& count) {
    return replaced(replaced(content, "WIDTH 4", "WIDTH " + count), "POINTS 4", "POINTS " + count);
  };
  const std::vector<Bad> all = {
      {"", "empty"},
      {"# Octomap OcTree binary file\nid OcTree\n", "an OctoMap tree; convert it to PCD"},
      {"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n", "Git LFS"},
      {"time,lat,lon\n0,1,2\n", "csv"},
      {"1.0 2.0 3.0\n", "rows of numbers"},
      {std::string(100, '\0'), "zeros"},
      {"hello\n", "text of another kind"},
      {"\x7f"
       "ELF\2\1\1",
       "binary data"},
      // Wrong counts.
      {with_count(binary, "1000000000000"), "promises 1000000000000 points, and 10000000 are read"},
      {with_count(binary, "9999999"), "cut short"},
      {with_count(text, "9999999"), "promises 9999999 points and 4 follow"},
      {with_count(lzf, "9999999"), "do not unpack to"},
      {with_count(text, "-4"), "line 7: WIDTH is not a count"},
      {with_count(text, "4e9"), "line 7: WIDTH is not a count"},
      {with_count(text, "99999999999999999999999"), "line 7: WIDTH is not a count"},
      {with_count(text, "0"), "no points"},
      {replaced(text, "WIDTH 4\nHEIGHT 1", "WIDTH 4294967296\nHEIGHT 4294967296"),
       "4294967296 x 4294967296"},
      {replaced(text, "HEIGHT 1", "HEIGHT 2"), "4 points, and also 4 x 2"},
      {with_count(text, "3"), "line 14 comes after the last point"},
      {replaced(vertices, "vertex 4", "vertex 9999999"), "cut short"},
      {replaced(vertices, "vertex 4", "vertex 99999999999"), "are read at most"},
      {replaced(vertices, "vertex 4", "vertex -4"), "line 6"},
      {replaced(vertices, "camera 2", "camera 2305843009213693952"), "camera is cut short"},
      {replaced(vertices, "camera 2\n", "camera 2\nproperty list uint float v\n"), "has lists"},
      // Wrong sizes of compressed data.
      {with_sizes(4'000'000'000U, 100), "cut short"},
      {with_sizes(30, 4'000'000'000U), "do not unpack to 4000000000"},
      {with_sizes(1, 100), "1 bytes of compressed data cannot hold 100"},
      {lzf.substr(0, lzf_start + 3), "ends before its compressed data"},
      {lzf.substr(0, lzf_start + 8) + std::string(lzf.size() - lzf_start - 8, '\xff'), "damaged"},
      // Wrong headers.
      {replaced(text, "FIELDS label z normal x y", "FIELDS label z normal x w"), "no field y"},
      {replaced(text, "FIELDS label z normal x y", "FIELDS label z normal x x"), "names x twice"},
      {replaced(text, "SIZE 1 4 4 4 4", "SIZE 1 4 4 4"), "line 4: SIZE has 4 entries, and FIELDS"},
      {replaced(text, "SIZE 1 4", "SIZE 1 3"), "line 5: field z is of type F and size 3"},
      {replaced(text, "COUNT 1 1 3", "COUNT 1 2 3"), "the COUNT of z is not 1"},
      {replaced(text, "COUNT 1 1 3", "COUNT 1 1 18446744073709551615"), "COUNT of field normal"},
      {replaced(text, "COUNT 1 1 3", "COUNT 1 1 60000"), "more than 65536 bytes"},
      {replaced(text, "VERSION 0.7", "VERSION 0.9"), "line 2: version \"0.9\""},
      {replaced(text, "DATA ascii", "DATA base64"), "line 10: DATA is ascii, binary"},
      {replaced(text, "HEIGHT", "HIEGHT"), "line 8: \"HIEGHT\" is not a word"},
      {replaced(text, "HEIGHT 1", "WIDTH 4"), "line 8 gives WIDTH again"},
      {text.substr(0, text.find("DATA")), "no DATA line: the file ends after line 9"},
      {"# .PCD v0.7\nVERSION 0.7\n" + std::string(3'000'000, '#'), "line 3 is longer than 1 MiB"},
      {replaced(vertices, "1.0", "2.0"), "line 2"},
      {replaced(vertices, "binary_little_endian", "binary_middle"), "\"binary_middle\""},
      {replaced(vertices, "property float z", "property float depth"), "have no z"},
      {replaced(vertices, "property short id", "property list uint int id"), "have lists"},
      {replaced(vertices, "element vertex", "element vertices"), "no element vertex"},
      // Wrong rows.
      {replaced(text, "7 3 0.5 0.25 7e30 1 2", "7 3 0.5 0.25 7e30 1,0 2"),
       "line 11: x is \"1,0\", which is not a number"},
      {replaced(text, "7 3 0.5 0.25 7e30 1 2", "7 3 0.5 0.25 1 2"), "line 11 has 6 values"},
  };
  for (const Bad& bad : all) {
    const std::string path = scratch.with(bad.content);
    testing::reset_allocations();
    const auto cloud = read_cloud(path, {});
    const std::size_t largest = testing::allocations().largest;
    ASSERT_FALSE(cloud) << bad.reason;
    EXPECT_THAT(cloud.error(), HasSubstr(bad.reason));
    EXPECT_LE(largest, std::size_t{1} << 20) << bad.reason;
  }
  EXPECT_THAT(read_cloud(scratch.folder().string(), {}).error(), HasSubstr("a directory"));
  EXPECT_THAT(read_cloud((scratch.folder() / "none").string(), {}).error(),
              HasSubstr("no such file"));
  EXPECT_THAT(read_cloud("/dev/zero", {}).error(), HasSubstr("not a regular file"));
  const CloudOptions three{.unit_m = 1.0, .max_points = 3};
  EXPECT_THAT(read_cloud(scratch.with(binary), three).error(), HasSubstr("3 are read at most"));
}

TEST(Cloud, AHeaderOfAGigabyteIsRefusedUnread) {
  const Scratch scratch;
  for (const char* start : {"# .PCD v0.7\n", "ply\nformat ascii 1.0\n"}) {
    const std::string path = scratch.with(start);
    // A sparse file of zeros, which uses no disk space.
    fs::resize_file(path, std::uintmax_t{1} << 30);
    testing::reset_allocations();
    const auto cloud = read_cloud(path, {});
    ASSERT_FALSE(cloud);
    EXPECT_THAT(cloud.error(), HasSubstr("longer than 1 MiB"));
    EXPECT_LE(testing::allocations().largest, std::size_t{1} << 20);
  }
  std::string comments = "# .PCD v0.7\n";
  for (int i = 0; i < 100'000; ++i) comments += "# and one more line\n";
  EXPECT_THAT(read_cloud(scratch.with(comments), {}).error(), HasSubstr("header is longer than"));
}

TEST(ToPly, IsReadBack) {
  std::vector<Vector3f> points;
  for (int i = 0; i < 100'000; ++i) {
    points.emplace_back(static_cast<float>(i) * 0.01F, -2.0F, 1e-30F);
  }
  const std::string text = to_ply(points, {"frame W, m", "two\nend_header\nlines"});
  EXPECT_THAT(text, HasSubstr("comment two end_header lines\n"));
  EXPECT_THAT(text, HasSubstr("element vertex 100000\nproperty float x\n"));
  const Scratch scratch;
  const auto cloud = read_cloud(scratch.with(text), kMetres);
  ASSERT_TRUE(cloud) << cloud.error();
  EXPECT_TRUE(cloud->points == points);
}

TEST(Cloud, TwentyThousandDamagedFilesHarmNobody) {
  const Scratch scratch;
  std::vector<Vector3d> points = kSome;
  for (int i = 0; i < 8; ++i) points.emplace_back(i, 0.5 * i, kNan);
  std::vector<std::string> good;
  for (const char* encoding : {"ascii", "binary", "binary_compressed"}) {
    good.push_back(pcd(points, encoding, "F4", "VIEWPOINT 0 0 0 1 0 0 0\n"));
    good.push_back(pcd(points, encoding, "I2"));
  }
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    good.push_back(ply(points, encoding, "double"));
  }
  const std::vector<std::string> pieces = {"-1",
                                           "99999999",
                                           "18446744073709551615",
                                           "nan",
                                           "\n",
                                           " ",
                                           "x",
                                           "list",
                                           "DATA binary\n",
                                           "0",
                                           "\xff\xff\xff\xff"};
  std::mt19937 random(20);
  const auto below = [&random](std::size_t n) { return random() % std::max<std::size_t>(n, 1); };
  std::size_t read = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string content = good[below(good.size())];
    for (std::size_t change = 0; change <= below(4); ++change) {
      const std::size_t at = below(content.size());
      switch (below(6)) {
        case 0:
          content.resize(at);
          break;
        case 1:
          content[at] = static_cast<char>(random());
          break;
        case 2:
          content[at] = static_cast<char>(content[at] ^ (1 << below(8)));
          break;
        case 3:
          content.insert(at, pieces[below(pieces.size())]);
          break;
        case 4:
          content.erase(at, below(20));
          break;
        default:
          content.insert(at, content.substr(below(content.size()), below(40)));
      }
      if (content.empty()) content = "p";
    }
    const std::string path = scratch.with(content);
    testing::reset_allocations();
    const auto cloud = read_cloud(path, {});
    ASSERT_LE(testing::allocations().largest, std::size_t{1} << 20) << content;
    if (!cloud) {
      ASSERT_FALSE(cloud.error().empty());
      continue;
    }
    ++read;
    ASSERT_FALSE(cloud->points.empty());
    ASSERT_LE(cloud->points.size() + cloud->dropped + cloud->duplicates, content.size());
    ASSERT_TRUE(std::all_of(cloud->points.begin(), cloud->points.end(),
                            [](const Vector3f& p) { return p.allFinite(); }));
  }
  EXPECT_GT(read, 2000U);
  EXPECT_LT(read, 18000U);
}

struct Count {
  std::size_t dropped = 0;
  std::set<std::array<float, 3>> different;
  std::size_t rows = 0;
};

/// Reads PCD whose first fields are x y z, 4-byte floats; sizes from its header.
Count count_naively(const std::string& content) {
  std::istringstream file(content);
  std::string line;
  std::string encoding;
  std::size_t promised = 0;
  std::size_t stride = 0;
  while (encoding.empty() && std::getline(file, line)) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "POINTS") words >> promised;
    if (keyword == "SIZE") {
      for (std::size_t size = 0; words >> size;) stride += size;
    }
    if (keyword == "DATA") words >> encoding;
  }
  std::vector<std::array<float, 3>> points;
  if (encoding == "ascii") {
    while (std::getline(file, line)) {
      char* next = line.data();
      std::array<float, 3> p{};
      for (float& value : p) value = std::strtof(next, &next);
      points.push_back(p);
    }
  } else {
    std::string data = content.substr(static_cast<std::size_t>(file.tellg()));
    const bool compressed = encoding == "binary_compressed";
    if (compressed) {
      std::string unpacked(promised * stride, '\0');
      lzf_decompress(data.data() + 8, static_cast<unsigned>(data.size() - 8), unpacked.data(),
                     static_cast<unsigned>(unpacked.size()));
      data = unpacked;
    }
    for (std::size_t i = 0; i < promised; ++i) {
      std::array<float, 3> p{};
      for (std::size_t k = 0; k < 3; ++k) {
        std::memcpy(&p[k], &data[compressed ? 4 * (k * promised + i) : i * stride + 4 * k], 4);
      }
      points.push_back(p);
    }
  }
  Count count{.dropped = 0, .different = {}, .rows = points.size()};
  EXPECT_EQ(points.size(), promised);
  for (const auto& p : points) {
    if (std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])) {
      count.different.insert(p);
    } else {
      ++count.dropped;
    }
  }
  return count;
}

TEST(RealClouds, AreCountedRightOrRefusedWithAReason) {
  const fs::path folder = DIVE_SHARED_DATA "/clouds";
  if (!fs::exists(folder)) GTEST_SKIP() << "the shared data is not here: " << folder;
  std::vector<fs::path> paths;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  std::size_t clouds = 0;
  for (const fs::path& path : paths) {
    const auto cloud = read_cloud(path.string(), {});
    fmt::print("{:<44} ", fs::relative(path, folder).string());
    if (!cloud) {
      fmt::print("refused: {}\n", cloud.error());
      EXPECT_NE(path.extension(), ".pcd") << cloud.error();
      EXPECT_EQ(path.extension() == ".bt", cloud.error().find("OctoMap") != std::string::npos);
      EXPECT_EQ(path.extension() == ".csv", cloud.error().find("csv") != std::string::npos);
      continue;
    }
    ++clouds;
    fmt::print("{:>7} points {:>6} dropped {:>6} duplicates, unit {} m, origin {} {} {}\n",
               cloud->points.size(), cloud->dropped, cloud->duplicates, cloud->unit_m,
               cloud->origin.x(), cloud->origin.y(), cloud->origin.z());
    for (const std::string& warning : cloud->warnings) fmt::print("    {}\n", warning);
    const Count count = count_naively(content_of(path));
    EXPECT_EQ(cloud->dropped, count.dropped) << path;
    EXPECT_EQ(cloud->points.size(), count.different.size()) << path;
    EXPECT_EQ(cloud->points.size() + cloud->dropped + cloud->duplicates, count.rows) << path;
    // The same points, not only the same number.
    std::size_t strangers = 0;
    for (const Vector3f& p : cloud->points) {
      const Vector3f at = ((cloud->origin + p.cast<double>()) / cloud->unit_m).cast<float>();
      if (!count.different.contains({at.x(), at.y(), at.z()})) ++strangers;
    }
    EXPECT_EQ(strangers, 0U) << path;
  }
  EXPECT_EQ(clouds, 12U);
}

}  // namespace
}  // namespace dive::planning
