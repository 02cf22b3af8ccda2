#pragma once
// A recorded flight of which the IMU and the truth are real, with made features along it: the IMU
// has the biases, the vibration and the scale errors of a real unit. Shares no code with the
// filter.
//
// Files as published with the ORB-SLAM papers for EuRoC: "ns,wx,wy,wz,ax,ay,az" at 200 Hz, and
// "ns,px,py,pz,qw,qx,qy,qz" at 20 Hz: the left camera's position in W, and the rotation from W to
// the camera (that convention, and not its inverse, agrees with the gyro and with gravity).

#include <optional>
#include <string>
#include <vector>

#include "common/measurements.h"
#include "test/estimation/visual_inertial/filter/made_features.h"

namespace dive::testing {

class RecordedFlight {
 public:
  struct TruePose {
    Utime utime = 0;
    Pose X_WB;
  };

  /// `folder` has NAME_imu.txt and NAME_truth.txt. Empty if they cannot be read.
  [[nodiscard]] static std::optional<RecordedFlight> read(const std::string& folder,
                                                          const std::string& name);

  /// The rig of all EuRoC recordings: left and right camera in the IMU's frame.
  [[nodiscard]] static std::vector<CameraModel> rig();

  [[nodiscard]] const std::vector<ImuSample>& imu() const { return imu_; }
  /// At the times of the images.
  [[nodiscard]] const std::vector<TruePose>& truth() const { return truth_; }
  /// False where the true positions jump: where they disagree by more than 5 mm with what the IMU
  /// measures between three images. Features made along such a path would jump too.
  [[nodiscard]] bool is_smooth(std::size_t first, std::size_t images) const;
  /// By central differences of the true positions, m/s in W.
  [[nodiscard]] Eigen::Vector3d velocity_W(std::size_t image) const;

 private:
  std::vector<ImuSample> imu_;
  std::vector<TruePose> truth_;
};

}  // namespace dive::testing
