#include "mission/executive/margin_monitor.h"

#include <algorithm>
#include <cmath>

namespace dive::mission {
namespace {

constexpr Utime kPeriod = 500'000;  // us: a fix comes as often
constexpr double kStep = 0.3;       // m between two poses

}  // namespace

void MarginMonitor::update(Utime now, planning::Scene& known, const Pose& X_WB,
                           std::span<const Pose> way, const Eigen::Matrix2d& P_W) {
  next_ = now + kPeriod;
  least_ = {};
  meter_.reduce(known, X_WB, P_W, least_);
  for (std::size_t i = 1; i < way.size(); ++i) {
    const double length = (way[i].p - way[i - 1].p).norm();
    const int steps = std::max(1, static_cast<int>(std::ceil(length / kStep)));
    for (int k = 1; k <= steps; ++k) {
      const double share = static_cast<double>(k) / steps;
      meter_.reduce(known, interpolate(way[i - 1], way[i], share), P_W, least_);
    }
  }
}

}  // namespace dive::mission
