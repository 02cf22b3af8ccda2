#pragma once
// The camera model of a sensor.yaml, by the names and the order of numbers of EuRoC, TUM-VI, ROS
// and Kalibr:
//
//   camera_model      intrinsics                         distortion_model
//   pinhole           [fu, fv, pu, pv]                   radial-tangential, equidistant, none
//   omni              [xi, fu, fv, pu, pv]               radial-tangential, none
//   eucm              [alpha, beta, fu, fv, pu, pv]      radial-tangential, none
//   ds                [xi, alpha, fu, fv, pu, pv]        radial-tangential, none
//
// Radial-tangential is also radtan, plumb_bob and rational_polynomial, with 0, 4, 5 or 8
// coefficients in OpenCV's order; equidistant is also equi, with 4. Without camera_model: pinhole;
// without distortion_model: radial-tangential for pinhole, else none.

#include <string>

#include <tl/expected.hpp>

#include "common/camera_model.h"
#include "estimation/dataset/sensor_file.h"

namespace dive::estimation {

/// Size, intrinsics and distortion; X_BC is left as it is. An error is "FILE:LINE: what", with the
/// names that are known or the count of numbers that is expected.
[[nodiscard]] tl::expected<CameraModel, std::string> read_camera_model(const SensorFile& file);

/// The keys from resolution to distortion_coefficients, with full precision, for
/// read_camera_model(). Models that Kalibr has are written as Kalibr names them.
[[nodiscard]] std::string camera_model_yaml(const CameraModel& camera);

}  // namespace dive::estimation
