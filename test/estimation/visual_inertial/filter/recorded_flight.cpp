#include "test/estimation/visual_inertial/filter/recorded_flight.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace dive::testing {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Row {
  Utime utime = 0;
  std::vector<double> values;
};

std::vector<Row> read_rows(const std::string& path) {
  std::vector<Row> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    Row row{std::strtoll(field.c_str(), nullptr, 10) / 1000, {}};
    while (std::getline(fields, field, ',')) row.values.push_back(std::atof(field.c_str()));
    rows.push_back(row);
  }
  return rows;
}

Pose pose_of(const double (&rows)[12]) {
  Eigen::Matrix3d R;
  R << rows[0], rows[1], rows[2], rows[4], rows[5], rows[6], rows[8], rows[9], rows[10];
  return {{rows[3], rows[7], rows[11]}, Quaterniond(R).normalized()};
}

}  // namespace

std::vector<CameraModel> RecordedFlight::rig() {
  CameraModel left;
  left.width = 752;
  left.height = 480;
  left.fx = 458.654;
  left.fy = 457.296;
  left.cx = 367.215;
  left.cy = 248.375;
  left.X_BC = pose_of({0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
                       0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,
                       -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949});
  CameraModel right = left;
  right.fx = 457.587;
  right.fy = 456.134;
  right.cx = 379.999;
  right.cy = 255.238;
  right.X_BC = pose_of({0.0125552670891, -0.999755099723, 0.0182237714554, -0.0198435579556,
                        0.999598781151, 0.0130119051815, 0.0251588363115, 0.0453689425024,
                        -0.0253898008918, 0.0179005838253, 0.999517347078, 0.00786212447038});
  return {left, right};
}

std::optional<RecordedFlight> RecordedFlight::read(const std::string& folder,
                                                   const std::string& name) {
  RecordedFlight flight;
  for (const Row& row : read_rows(folder + "/" + name + "_imu.txt")) {
    if (row.values.size() < 6) return std::nullopt;
    ImuSample sample;
    sample.utime = row.utime;
    sample.gyro_B = {row.values[0], row.values[1], row.values[2]};
    sample.accel_B = {row.values[3], row.values[4], row.values[5]};
    flight.imu_.push_back(sample);
  }
  const Pose X_CB = rig().front().X_BC.inverse();
  for (const Row& row : read_rows(folder + "/" + name + "_truth.txt")) {
    if (row.values.size() < 7) return std::nullopt;
    const auto& v = row.values;
    const Quaterniond q_CW(v[3], v[4], v[5], v[6]);
    const Pose X_WC{{v[0], v[1], v[2]}, q_CW.conjugate().normalized()};
    flight.truth_.push_back({row.utime, X_WC * X_CB});
  }
  if (flight.imu_.empty() || flight.truth_.size() < 3) return std::nullopt;
  return flight;
}

bool RecordedFlight::is_smooth(std::size_t first, std::size_t images) const {
  constexpr double kMost_m = 0.005;
  constexpr double kGravity = 9.81;
  for (std::size_t i = std::max<std::size_t>(first, 1);
       i < std::min(first + images, truth_.size() - 1); ++i) {
    const double dt = to_seconds(truth_[i].utime - truth_[i - 1].utime);
    if (std::abs(to_seconds(truth_[i + 1].utime - truth_[i].utime) - dt) > 0.01) continue;
    // p(t + dt) - 2 p(t) + p(t - dt) is the acceleration, weighted by a triangle, times dt^2.
    Vector3d force_B = Vector3d::Zero();
    double weights = 0.0;
    auto sample = std::lower_bound(imu_.begin(), imu_.end(), truth_[i - 1].utime,
                                   [](const ImuSample& s, Utime t) { return s.utime < t; });
    for (; sample != imu_.end() && sample->utime <= truth_[i + 1].utime; ++sample) {
      const double weight = 1.0 - std::abs(to_seconds(sample->utime - truth_[i].utime)) / dt;
      force_B += weight * sample->accel_B;
      weights += weight;
    }
    if (!(weights > 0.0)) continue;
    const Vector3d measured = truth_[i].X_WB.q * (force_B / weights) - kGravity * Vector3d::UnitZ();
    const Vector3d bent = truth_[i + 1].X_WB.p - 2.0 * truth_[i].X_WB.p + truth_[i - 1].X_WB.p;
    if ((bent - dt * dt * measured).norm() > kMost_m) return false;
  }
  return true;
}

Vector3d RecordedFlight::velocity_W(std::size_t image) const {
  const std::size_t before = image == 0 ? 0 : image - 1;
  const std::size_t after = std::min(image + 1, truth_.size() - 1);
  return (truth_[after].X_WB.p - truth_[before].X_WB.p) /
         to_seconds(truth_[after].utime - truth_[before].utime);
}

}  // namespace dive::testing
