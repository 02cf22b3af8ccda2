#include "estimation/visual_inertial/pipeline/restart_memory.h"

#include <algorithm>
#include <cmath>

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kBiasPeriod_s = 5.0;  // between two states that are remembered
constexpr double kBiasSafety = 2.0;    // of the biases' sigmas when it begins with them again
constexpr double kUsualSpeed = 0.4;    // m/s, of a vehicle that is not observed
constexpr double kMaxShare = 0.8;      // of the sigmas at which the filter takes itself as diverged

}  // namespace

double yaw_sigma(const StateEstimate& estimate) {
  const Vector3d up_B = estimate.X_WB.q.conjugate() * Vector3d::UnitZ();
  const double variance = up_B.dot(estimate.covariance.bottomRightCorner<3, 3>() * up_B);
  return std::sqrt(std::max(variance, 0.0));
}

RestartMemory::RestartMemory(const VisualInertialOptions& options, const VisionStart& start)
    : options_(options) {
  if (const auto* const images = std::get_if<ImageStart>(&start)) {
    first_.X_WB = {images->position_W, images->heading.normalized()};
    first_.position_sigma_m = images->position_sigma_m;
    first_.yaw_sigma = deg_to_rad(images->heading_sigma_deg);
    first_bias_ = images->bias;
  } else if (const auto* const known = std::get_if<KnownStart>(&start)) {
    first_.X_WB = known->X_WB;
    first_.speed = known->v_WB_B.norm();
    first_.position_sigma_m = known->position_sigma_m;
    first_.yaw_sigma = deg_to_rad(known->yaw_sigma_deg);
    first_bias_ = known->bias;
  }
  if (const auto* const published = std::get_if<PublishedStart>(&start);
      published != nullptr && published->bias) {
    const ImuBias& bias = *published->bias;
    proven_ =
        Known{bias.utime, {bias.gyro_B, bias.accel_B, bias.gyro_sigma, bias.accel_sigma}, first_};
  }
  last_ = first_;
}

void RestartMemory::add(const ImuSample& sample) {
  if (newest_ == 0) {
    first_.utime = last_.utime = sample.utime;
  } else if (const double dt = to_seconds(sample.utime - newest_);
             dt > options_.longest_imu_step_s) {
    unmeasured_s_ += dt;
  } else {
    turned_ = (turned_ * so3_exp(dt * (sample.gyro_B - newest_bias().gyro))).normalized();
  }
  newest_ = sample.utime;
}

BiasPrior RestartMemory::newest_bias() const {
  return recent_ ? recent_->bias : proven_ ? proven_->bias : first_bias_;
}

RestartMemory::Place RestartMemory::place_of(const StateEstimate& estimate) const {
  return {estimate.utime,      estimate.X_WB, estimate.v_WB_B.norm(), horizontal_sigma(estimate),
          yaw_sigma(estimate), turned_,       unmeasured_s_};
}

void RestartMemory::observe(const StateEstimate& estimate) { last_ = place_of(estimate); }

void RestartMemory::remember(Utime now, const FilterState& state, const StateEstimate& estimate) {
  if (recent_ && to_seconds(now - recent_->utime) < kBiasPeriod_s) return;
  if (recent_) proven_ = recent_;
  const auto sigmas = state.covariance().diagonal().segment<6>(imu_error::kGyroBias).cwiseSqrt();
  recent_ = Known{now,
                  {state.imu.gyro_bias, state.imu.accel_bias, sigmas.head<3>().maxCoeff(),
                   sigmas.tail<3>().maxCoeff()},
                  place_of(estimate)};
}

void RestartMemory::restart(bool has_failed) {
  recent_.reset();
  if (has_failed) last_ = proven_ ? proven_->place : first_;
}

std::optional<BiasPrior> RestartMemory::bias_at(Utime utime) const {
  if (!proven_) return std::nullopt;
  BiasPrior bias = proven_->bias;
  const double seconds = std::max(to_seconds(utime - proven_->utime), 0.0);
  const auto grown = [seconds](double sigma, double walk, double most) {
    return std::min(kBiasSafety * std::sqrt(sigma * sigma + walk * walk * seconds), most);
  };
  bias.gyro_sigma = grown(*bias.gyro_sigma, options_.imu.gyro_walk, options_.gyro_bias_sigma);
  bias.accel_sigma = grown(*bias.accel_sigma, options_.imu.accel_walk, options_.accel_bias_sigma);
  return bias;
}

std::optional<ImuBias> RestartMemory::proven_bias() const {
  if (!proven_) return std::nullopt;
  const BiasPrior& bias = proven_->bias;
  return ImuBias{proven_->utime, bias.gyro, bias.accel, *bias.gyro_sigma, *bias.accel_sigma};
}

ImageStart RestartMemory::image_start() const {
  const double seconds = std::max(to_seconds(newest_ - last_.utime), 0.0);
  ImageStart start;
  start.utime = newest_;
  start.bias = bias_at(newest_).value_or(first_bias_);
  start.position_W = last_.X_WB.p;
  start.position_sigma_m =
      std::clamp(std::hypot(last_.position_sigma_m, std::max(last_.speed, kUsualSpeed) * seconds),
                 kMinStartSigma_m, kMaxShare * options_.max_position_sigma_m);
  start.heading = (last_.X_WB.q * last_.turned.conjugate() * turned_).normalized();
  const double by_bias = seconds * start.bias.gyro_sigma.value_or(options_.gyro_bias_sigma);
  const double by_gaps = options_.unknown_rate_sigma * (unmeasured_s_ - last_.unmeasured_s);
  start.heading_sigma_deg =
      std::clamp(rad_to_deg(std::hypot(last_.yaw_sigma, std::hypot(by_bias, by_gaps))),
                 kMinStartYawSigma_deg, kMaxShare * options_.max_attitude_sigma_deg);
  return start;
}

}  // namespace dive::estimation
