#pragma once
// Initialisation of the filter from images and IMU samples: at rest, in steady motion,
// accelerating, in any attitude; with one camera or two, with or without depth. Images tell rest
// from steady swimming; the IMU cannot. From the gyro's bias (gyro_bias_fit.h) to velocity and
// gravity (first_motion.h) to the most likely motion and its covariance (window_fit.h).

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/measurements.h"
#include "estimation/visual_inertial/filter/filter_start.h"
#include "estimation/visual_inertial/filter/window_fit.h"

namespace dive::estimation {

class ImageInitialiser {
 public:
  explicit ImageInitialiser(const VisualInertialOptions& options) : options_(options) {}

  void reset();
  void add(const DepthSample& sample);
  /// A measured speed, newer than that of the start.
  void add(const ImageStart::Speed& speed) { measured_ = speed; }
  /// `utime`: of the frame, by the IMU's clock.
  void add(Utime utime, FeatureFrame frame);

  /// The state at the last frame, as soon as the images determine it. `calibrated`: poses of the
  /// cameras and intrinsics of the IMU as known.
  [[nodiscard]] std::optional<InitialState> begin(const ImageStart& start, const ImuBuffer& imu,
                                                  const FilterState& calibrated);
  /// What it waits for, in words.
  [[nodiscard]] const std::string& waits_for() const { return waits_for_; }

 private:
  struct Seen {
    Utime utime = 0;
    FeatureFrame frame;
  };

  [[nodiscard]] std::optional<double> rest_s() const;
  [[nodiscard]] StartWindow window(double seconds, const ImuBuffer& imu) const;
  [[nodiscard]] std::optional<double> depth_at(Utime utime) const;
  void follow(const std::vector<const Seen*>& chosen, StartWindow& window) const;
  [[nodiscard]] std::optional<WindowPriors::Speed> speed_in(const ImageStart& start,
                                                            const StartWindow& window) const;
  [[nodiscard]] std::optional<WindowFit> fit_in_motion(const StartWindow& window,
                                                       const std::vector<Pose>& cameras_B,
                                                       const WindowPriors& priors,
                                                       ImuState first) const;
  [[nodiscard]] std::optional<InitialState> fit(const ImageStart& start,
                                                std::optional<double> rest_s,
                                                const StartWindow& window, const ImuBuffer& imu,
                                                const FilterState& calibrated);
  void follow_heading(const ImageStart& start, const ImuBuffer& imu);

  VisualInertialOptions options_;
  std::deque<Seen> frames_;
  std::deque<DepthSample> depth_;
  std::optional<ImageStart::Speed> measured_;
  /// Of position and heading of the start, and up to when `turned_` is known.
  std::optional<Utime> since_, turned_at_;
  Eigen::Quaterniond turned_ = Eigen::Quaterniond::Identity();  ///< Since then, by the gyro.
  Utime tried_ = 0;                                             ///< Last frame of the last attempt.
  std::string waits_for_ = "images";
};

}  // namespace dive::estimation
