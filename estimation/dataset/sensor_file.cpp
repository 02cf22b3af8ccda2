#include "estimation/dataset/sensor_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "common/input_file.h"
#include "common/source_text.h"

namespace dive::estimation {
namespace {

constexpr double kRotation = 1e-3;      // tolerance of a written rotation matrix
constexpr double kMaxLever_m = 1000.0;  // from the body frame to a sensor
constexpr std::size_t kMaxBytes = std::size_t{1} << 20U;

std::string located(const std::string& path, const YAML::Mark& mark, const std::string& what) {
  if (mark.is_null()) return fmt::format("{}: {}", path, what);
  return fmt::format("{}:{}: {}", path, mark.line + 1, what);
}

// By the first bytes of the formats that bag_file.h reads.
bool is_bag(const std::string& path) {
  const auto file = open_input_stream(path);
  std::array<char, 8> bytes{};
  if (!file || !(*file)->read(bytes.data(), bytes.size())) return false;
  const std::string_view begin(bytes.data(), bytes.size());
  return begin == "#ROSBAG " || begin == "\x89MCAP0\r\n" || begin == "SQLite f";
}

bool to_finite(const YAML::Node& node, double& value) {
  return YAML::convert<double>::decode(node, value) && std::isfinite(value);
}

}  // namespace

struct SensorFile::Impl {
  std::string path;
  YAML::Node root;

  [[nodiscard]] YAML::Node find(const std::string& key) const {
    const YAML::Node node = std::as_const(root)[key];
    if (node.IsDefined()) return node;
    for (const auto& [ours, kalibr] :
         {std::pair("distortion_coefficients", "distortion_coeffs"), {"rate_hz", "update_rate"}}) {
      if (key == ours) return std::as_const(root)[kalibr];
    }
    return node;
  }
  [[nodiscard]] tl::unexpected<std::string> wrong(const YAML::Node& node,
                                                  const std::string& what) const {
    return tl::make_unexpected(
        located(path, node.IsDefined() ? node.Mark() : YAML::Mark::null_mark(), what));
  }
};

SensorFile::SensorFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SensorFile::SensorFile(SensorFile&&) noexcept = default;
SensorFile& SensorFile::operator=(SensorFile&&) noexcept = default;
SensorFile::~SensorFile() = default;

tl::expected<SensorFile, std::string> SensorFile::open(const std::string& path) {
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  if (is_bag(path)) {
    return tl::make_unexpected(fmt::format("{}: is a bag, not a calibration", path));
  }
  const auto file = read_source_text(path, kMaxBytes);
  if (!file) return tl::make_unexpected(fmt::format("{}: {}", path, file.error()));
  std::string text = file->content();
  // OpenCV's directive "%YAML:1.0" is none of YAML.
  if (text.starts_with("%YAML:")) text.front() = '#';
  try {
    impl->root = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    return tl::make_unexpected(located(path, e.mark, e.msg));
  }
  if (!impl->root.IsMap()) return impl->wrong(impl->root, "keys and values are expected");
  return SensorFile(std::move(impl));
}

tl::expected<std::vector<double>, std::string> SensorFile::numbers(
    const std::string& key, const std::vector<std::size_t>& counts) const {
  const YAML::Node node = impl_->find(key);
  if (!node.IsDefined()) return impl_->wrong(node, fmt::format("there is no {}", key));
  if (!node.IsSequence() || std::find(counts.begin(), counts.end(), node.size()) == counts.end()) {
    return impl_->wrong(
        node, fmt::format("{} must be a list of {} numbers", key, fmt::join(counts, " or ")));
  }
  std::vector<double> values(node.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!to_finite(node[i], values[i])) {
      return impl_->wrong(node[i], fmt::format("number {} of {} is not a number", i + 1, key));
    }
  }
  return values;
}

bool SensorFile::has(const std::string& key) const { return impl_->find(key).IsDefined(); }

std::string SensorFile::at(const std::string& key, const std::string& what) const {
  return impl_->wrong(impl_->find(key), what).value();
}

tl::expected<std::optional<double>, std::string> SensorFile::number(const std::string& key) const {
  const YAML::Node node = impl_->find(key);
  if (!node.IsDefined()) return std::nullopt;
  double value = 0.0;
  if (!to_finite(node, value)) return impl_->wrong(node, fmt::format("{} is not a number", key));
  return value;
}

tl::expected<std::optional<std::string>, std::string> SensorFile::word(
    const std::string& key) const {
  const YAML::Node node = impl_->find(key);
  if (!node.IsDefined()) return std::nullopt;
  if (!node.IsScalar()) return impl_->wrong(node, fmt::format("{} is not a word", key));
  return node.Scalar();
}

int SensorFile::line_of(const std::string& key) const {
  const YAML::Node node = impl_->find(key);
  return node.IsDefined() ? node.Mark().line + 1 : 0;
}

std::optional<SensorFile> SensorFile::section(const std::string& key) const {
  const YAML::Node node = impl_->find(key);
  if (!node.IsDefined() || !node.IsMap()) return std::nullopt;
  auto impl = std::make_unique<Impl>();
  impl->path = impl_->path;
  impl->root = node;
  return SensorFile(std::move(impl));
}

tl::expected<Pose, std::string> SensorFile::X_BS() const {
  const bool is_kalibr = has("T_cam_imu");
  const char* const key = is_kalibr ? "T_cam_imu" : "T_BS";
  const YAML::Node node = impl_->find(key);
  if (!node.IsDefined()) return Pose{};
  const YAML::Node data = node.IsMap() ? std::as_const(node)["data"] : node;
  std::vector<YAML::Node> numbers;
  if (data.IsDefined() && data.IsSequence()) {
    for (const YAML::Node& row : data) {
      if (!row.IsSequence()) numbers.push_back(row);
      if (!row.IsSequence()) continue;
      for (const YAML::Node& number : row) numbers.push_back(number);
    }
  }
  if (numbers.size() != 16) {
    return impl_->wrong(node, fmt::format("{} must have data of 16 numbers, row by row", key));
  }
  Eigen::Matrix4d T;
  for (int i = 0; i < 16; ++i) {
    const YAML::Node& number = numbers[static_cast<std::size_t>(i)];
    if (!to_finite(number, T(i / 4, i % 4))) {
      return impl_->wrong(number, fmt::format("number {} of {} is not a number", i + 1, key));
    }
  }
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const bool is_rotation =
      (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < kRotation && R.determinant() > 0.0;
  const bool is_near = T.topRightCorner<3, 1>().cwiseAbs().maxCoeff() <= kMaxLever_m;
  if (!is_rotation || !is_near || (T.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-9) {
    return impl_->wrong(
        node, fmt::format("{} is not a pose: rotation, translation (m) and a row 0 0 0 1", key));
  }
  const Pose X{T.topRightCorner<3, 1>(), Eigen::Quaterniond(R).normalized()};
  return is_kalibr ? X.inverse() : X;
}

}  // namespace dive::estimation
