#pragma once
// A current that is stated before the dive: the horizontal velocity of the water over ground as a
// function of the time since the mission started. Uniform in space.

#include <vector>

#include <Eigen/Core>

namespace dive {

/// A plain value. Still water unless made otherwise.
class DeclaredCurrent {
 public:
  /// Largest speed of a current, m/s.
  static constexpr double kMaxSpeed = 3.0;
  /// Largest number of samples of a table.
  static constexpr std::size_t kMaxSamples = 1000;

  struct Sample {
    double elapsed_s = 0.0;  ///< Time since the mission started, s; may be negative.
    Eigen::Vector2d velocity_W = Eigen::Vector2d::Zero();  ///< East and north, m/s.
  };

  DeclaredCurrent() = default;
  /// A constant current. Demands a finite velocity of at most kMaxSpeed.
  explicit DeclaredCurrent(const Eigen::Vector2d& velocity_W);
  /// A table, its vectors interpolated linearly in time. Demands 2 to kMaxSamples finite samples of
  /// at most kMaxSpeed, their times strictly increasing.
  explicit DeclaredCurrent(std::vector<Sample> samples);

  /// Velocity of the water over ground, m/s. Outside of a table its first or last value holds. Does
  /// not allocate.
  [[nodiscard]] Eigen::Vector2d at(double elapsed_s) const;
  /// True if the value is given for all of [from_s, to_s]: a constant is given for all times.
  [[nodiscard]] bool covers(double from_s, double to_s) const;
  /// The same current with the time counted from `elapsed_s` on.
  [[nodiscard]] DeclaredCurrent from(double elapsed_s) const;
  /// True if the water never moves.
  [[nodiscard]] bool is_still() const;
  /// The samples; one of a constant current, none of still water.
  [[nodiscard]] const std::vector<Sample>& samples() const { return samples_; }

 private:
  std::vector<Sample> samples_;
};

/// The velocity (east, north, m/s) of water that flows with `speed` (m/s) towards the compass
/// heading `towards_deg` (clockwise from north).
[[nodiscard]] Eigen::Vector2d flow_towards(double speed, double towards_deg);

}  // namespace dive
