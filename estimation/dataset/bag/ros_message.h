#pragma once
// Messages of sensors, in ROS 1's serialisation or as CDR (ROS 2): the fields that a recording
// needs. Stamps are those of the header, when the sensor measured.

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "common/measurements.h"
#include "estimation/dataset/bag/bag_file.h"
#include "estimation/dataset/recording.h"

namespace dive::estimation {

/// A sensor_msgs/FluidPressure; Pa by its definition, but not in every data set.
struct PressureSample {
  Utime utime = 0;
  double pressure = 0.0;
};

/// sensor_msgs/Imu. The errors of all functions here are clauses with the reason. Values may be
/// those of no measurement, such as NaN: screen_samples() refuses them.
[[nodiscard]] tl::expected<ImuSample, std::string> decode_imu(Bytes bytes, Serialization kind);

[[nodiscard]] tl::expected<PressureSample, std::string> decode_pressure(Bytes bytes,
                                                                        Serialization kind);

/// True for a type that decode_velocity() reads.
[[nodiscard]] bool is_velocity_type(std::string_view type);
/// geometry_msgs/TwistStamped, TwistWithCovarianceStamped: the linear part, of whatever frame.
[[nodiscard]] tl::expected<VelocitySample, std::string> decode_velocity(Bytes bytes,
                                                                        Serialization kind);

/// True for a type that decode_pose() reads.
[[nodiscard]] bool is_pose_type(std::string_view type);
/// False for one without an attitude.
[[nodiscard]] bool has_attitude(std::string_view type);
/// geometry_msgs/PoseStamped, PoseWithCovarianceStamped, TransformStamped, PointStamped,
/// nav_msgs/Odometry: the pose as it is given, of whatever frame.
[[nodiscard]] tl::expected<TruePose, std::string> decode_pose(Bytes bytes, std::string_view type,
                                                              Serialization kind);

/// The stamp in the header with which every message here begins.
[[nodiscard]] tl::expected<Utime, std::string> decode_stamp(Bytes bytes, Serialization kind);

/// True for a type that decode_image() reads.
[[nodiscard]] bool is_image_type(std::string_view type);
/// sensor_msgs/Image with 8 or 16 bits grey, or 8 bits in three or four colours, and
/// sensor_msgs/CompressedImage with a PNG or JPEG image: as grey with 8 bits.
/// `wide_bits`: how many of 16 bits are used, from 8 to 16.
[[nodiscard]] tl::expected<ImageFrame, std::string> decode_image(Bytes bytes, std::string_view type,
                                                                 Serialization kind,
                                                                 int wide_bits = 16);

/// Bits of the greatest value in an image with 16 bits grey; 0 for other images and damaged ones.
[[nodiscard]] int used_bits(Bytes bytes, std::string_view type, Serialization kind);

}  // namespace dive::estimation
