#pragma once
// A sensor.yaml in the ASL format, or a section of a calibration by Kalibr (Furgale et al. 2013),
// whose keys for the same values are known too: distortion_coeffs for distortion_coefficients,
// update_rate for rate_hz, and T_cam_imu, the inverse of T_BS with the IMU as body frame.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/se3.h"

namespace dive::estimation {

class SensorFile {
 public:
  [[nodiscard]] static tl::expected<SensorFile, std::string> open(const std::string& path);
  SensorFile(SensorFile&&) noexcept;
  SensorFile& operator=(SensorFile&&) noexcept;
  ~SensorFile();

  /// The section of that name; empty if there is none.
  [[nodiscard]] std::optional<SensorFile> section(const std::string& key) const;

  /// T_BS: pose of the sensor in the files' body frame; identity if not given. Errors are
  /// "FILE:LINE: what".
  [[nodiscard]] tl::expected<Pose, std::string> X_BS() const;
  /// A list of finite numbers, as many as one of `counts`.
  [[nodiscard]] tl::expected<std::vector<double>, std::string> numbers(
      const std::string& key, const std::vector<std::size_t>& counts) const;
  [[nodiscard]] bool has(const std::string& key) const;
  /// "FILE:LINE: what", with the line of the key's value, if there is one.
  [[nodiscard]] std::string at(const std::string& key, const std::string& what) const;
  /// Empty if there is no such key.
  [[nodiscard]] tl::expected<std::optional<double>, std::string> number(
      const std::string& key) const;
  [[nodiscard]] tl::expected<std::optional<std::string>, std::string> word(
      const std::string& key) const;
  /// Line of a key's value, from 1; 0 if there is none.
  [[nodiscard]] int line_of(const std::string& key) const;

 private:
  struct Impl;
  explicit SensorFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::estimation
