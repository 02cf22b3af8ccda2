#include "test/estimation/visual_inertial/filter/filter_dive.h"

#include <cmath>
#include <ctime>

#include <Eigen/Cholesky>

namespace dive::testing {
namespace {

using estimation::VisualInertialFilter;
// Processor time of this process: other load on the machine affects it little.
double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Times of an event with a given rate.
class Beat {
 public:
  explicit Beat(double hz, double begin) : period_(1.0 / hz), next_(begin) {}
  bool falls(double t) {
    if (t < next_ - 1e-9) return false;
    next_ += period_;
    return true;
  }

 private:
  double period_;
  double next_;
};

Eigen::Vector3d normal3(Random& random, double sigma) {
  const double x = random.normal();
  const double y = random.normal();
  return sigma * Eigen::Vector3d(x, y, random.normal());
}

}  // namespace

estimation::VisualInertialOptions filter_options(const AnalyticDive& dive,
                                                 const AnalyticDiveOptions& options) {
  estimation::VisualInertialOptions result;
  result.cameras = dive.cameras();
  result.imu = {options.gyro_noise, options.accel_noise, options.gyro_walk, options.accel_walk};
  result.imu.gyro_by_accel = options.gyro_by_accel_sigma;
  result.imu_scale_sigma = options.imu_scale_sigma;
  result.pixel_sigma = options.pixel_sigma;
  result.depth_sigma_m = options.depth_sigma_m;
  result.depth_bias_sigma_m = options.depth_bias_sigma_m;
  result.focal_sigma = options.focal_sigma;
  if (options.focal_sigma > 0.0) result.centre_sigma_px = options.centre_sigma_px;
  result.refractive_index_sigma = options.refractive_index_sigma;
  if (options.extrinsic_sigma_m > 0.0) {
    result.extrinsic_sigma_deg = options.extrinsic_sigma_deg;
    result.extrinsic_sigma_m = options.extrinsic_sigma_m;
  }
  return result;
}

estimation::KnownStart known_start(const AnalyticDive& dive, double t, Random& random,
                                   estimation::KnownStart start) {
  constexpr double kGyroBias = 0.002;
  constexpr double kAccelBias = 0.02;
  const DiveTruth truth = dive.truth(t);
  start.utime = from_seconds(t);
  start.X_WB.p = truth.X_WB.p + normal3(random, start.position_sigma_m);
  const Eigen::Vector3d turn_deg =
      normal3(random, 1.0)
          .cwiseProduct(
              Eigen::Vector3d(start.tilt_sigma_deg, start.tilt_sigma_deg, start.yaw_sigma_deg));
  start.X_WB.q = so3_exp(deg_to_rad(1.0) * turn_deg) * truth.X_WB.q;
  start.v_WB_B = truth.v_WB_B + normal3(random, start.speed_sigma);
  start.bias = {dive.gyro_bias() + normal3(random, kGyroBias),
                dive.accel_bias() + normal3(random, kAccelBias), kGyroBias, kAccelBias};
  return start;
}

ErrorSample compare(const estimation::StateEstimate& estimate, const DiveTruth& truth) {
  ErrorSample sample;
  sample.t = to_seconds(estimate.utime);
  sample.position = truth.X_WB.p - estimate.X_WB.p;
  const Eigen::AngleAxisd turn(estimate.X_WB.q.conjugate() * truth.X_WB.q);
  const Eigen::Vector3d attitude = turn.angle() * turn.axis();
  sample.attitude = attitude.norm();
  const Eigen::Matrix3d P = estimate.covariance.topLeftCorner<3, 3>();
  const Eigen::Matrix3d A = estimate.covariance.bottomRightCorner<3, 3>();
  sample.nees_position = sample.position.dot(P.llt().solve(sample.position));
  sample.nees_attitude = attitude.dot(A.llt().solve(attitude));
  return sample;
}

FilterDiveResult run(AnalyticDive& dive, const AnalyticDiveOptions& options,
                     VisualInertialFilter& filter, double begin, double end, const Hooks& hooks) {
  FilterDiveResult result;
  Beat imu(options.imu_hz, begin);
  Beat frames(options.frame_hz, begin + 0.02);
  Beat depths(options.depth_hz, begin);
  Beat seconds(1.0, begin + 1.0);
  double since_frame_s = 0.0;
  std::int64_t frames_done = 0;
  const Utime tick = from_seconds(1.0 / options.imu_hz);
  for (Utime utime = from_seconds(begin); to_seconds(utime) <= end; utime += tick) {
    const double t = to_seconds(utime);
    const bool is_frame = frames.falls(t) && hooks.has_frame(t);
    estimation::FeatureFrame frame;
    if (is_frame) frame = dive.frame(utime);
    for (const auto& feature : frame.features) {
      if (AnalyticDive::is_snow(feature.id)) result.snow.insert(feature.id);
    }
    std::optional<ImuSample> reading;
    std::optional<DepthSample> sounding;
    if (imu.falls(t)) reading = dive.imu(utime);
    if (depths.falls(t)) sounding = dive.depth(utime);
    if (is_frame) hooks.spoil_frame(t, frame);
    if (reading) hooks.spoil_imu(t, *reading);
    if (sounding) hooks.spoil_depth(t, *sounding);
    const double began = processor_seconds();
    if (reading) filter.add(*reading);
    if (sounding) filter.add(*sounding);
    if (is_frame) filter.add(std::move(frame));
    hooks.each_tick(t, filter);
    const estimation::StateEstimate& estimate = filter.update(utime);
    since_frame_s += processor_seconds() - began;
    if (filter.state_frames() != frames_done) {
      frames_done = filter.state_frames();
      result.frame_ms.push_back(1e3 * since_frame_s);
      since_frame_s = 0.0;
      for (const auto& landmark : filter.landmarks()) {
        ++result.used;
        if (!AnalyticDive::is_snow(landmark.id)) continue;
        ++result.used_particles;
        result.accepted_particles.insert(landmark.id);
      }
    }
    const DiveTruth truth = dive.truth(t);
    result.distance_m += truth.v_WB_B.norm() * to_seconds(tick);
    if (!estimate.valid || !seconds.falls(t)) continue;
    result.errors.push_back(compare(estimate, truth));
    hooks.each_second(result.errors.back());
  }
  return result;
}

}  // namespace dive::testing
