#include "estimation/dataset/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include <fmt/format.h>

#include "estimation/dataset/csv_table.h"

namespace dive::estimation {

std::string to_tum(const Trajectory& trajectory) {
  std::string text = "# t x y z qx qy qz qw\n";
  for (const StampedPose& at : trajectory) {
    const Pose& X = at.X_WB;
    text += fmt::format("{}.{:06} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                        at.utime / kMicrosecondsPerSecond, at.utime % kMicrosecondsPerSecond,
                        X.p.x(), X.p.y(), X.p.z(), X.q.x(), X.q.y(), X.q.z(), X.q.w());
  }
  return text;
}

tl::expected<Trajectory, std::string> from_tum(const std::string& text, const std::string& name) {
  Trajectory trajectory;
  std::istringstream lines(text);
  std::size_t number = 0;
  const auto fail = [&](const std::string& what) {
    return tl::make_unexpected(fmt::format("{}:{}: {}", name, number, what));
  };
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line);
    std::vector<std::string> fields;
    for (std::string word; words >> word;) fields.push_back(word);
    if (fields.empty() || fields[0].front() == '#') continue;
    std::array<double, 8> v{};
    if (fields.size() != v.size()) {
      return fail(fmt::format("{} numbers; 8 are expected: t x y z qx qy qz qw", fields.size()));
    }
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (!to_number(fields[i], v[i])) {
        return fail(fmt::format("\"{}\" is not a finite number", fields[i]));
      }
    }
    if (!(v[0] >= 0.0 && v[0] < 9e12))
      return fail("its time is not from 0 to 9e12; seconds are expected");
    const Eigen::Quaterniond q(v[7], v[4], v[5], v[6]);
    if (std::abs(q.norm() - 1.0) > 1e-2) return fail("its quaternion is not of length 1");
    const Utime utime = from_seconds(v[0]);
    if (!trajectory.empty() && utime <= trajectory.back().utime) {
      return fail("its time is not later than that of the pose before");
    }
    trajectory.push_back({utime, Pose{{v[1], v[2], v[3]}, q.normalized()}});
  }
  return trajectory;
}

double length_of(const Trajectory& trajectory) {
  double length = 0.0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length += (trajectory[i].X_WB.p - trajectory[i - 1].X_WB.p).norm();
  }
  return length;
}

std::optional<Pose> pose_at(const Trajectory& trajectory, Utime utime, double max_gap_s) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), utime,
                                      [](const StampedPose& a, Utime t) { return a.utime < t; });
  if (after == trajectory.end()) return std::nullopt;
  if (after->utime == utime) return after->X_WB;
  if (after == trajectory.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double gap = to_seconds(after->utime - before->utime);
  if (gap > max_gap_s) return std::nullopt;
  return interpolate(before->X_WB, after->X_WB, to_seconds(utime - before->utime) / gap);
}

}  // namespace dive::estimation
