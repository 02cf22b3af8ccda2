#include "estimation/dataset/bag/ros_message.h"

#include <fmt/format.h>

#include "estimation/dataset/bag/message_reader.h"
#include "estimation/dataset/sample_screen.h"

namespace dive::estimation {
namespace {

using Failure = tl::unexpected<std::string>;

// The reason why a message cannot be used; empty if it can.
std::string problem(const MessageReader& reader, Utime utime) {
  if (!reader.ok()) return "the message is shorter than its type, or of another encoding";
  if (utime < 0) return "it has no valid stamp";
  return {};
}

}  // namespace

tl::expected<ImuSample, std::string> decode_imu(Bytes bytes, Serialization kind) {
  MessageReader reader(bytes, kind);
  ImuSample sample;
  sample.utime = reader.take_header();
  reader.skip_numbers(4 + 9);  // attitude by the unit's own filter, which few units have
  sample.gyro_B = reader.take_vector();
  reader.skip_numbers(9);
  sample.accel_B = reader.take_vector();
  if (const std::string why = problem(reader, sample.utime); !why.empty()) return Failure(why);
  return sample;
}

tl::expected<PressureSample, std::string> decode_pressure(Bytes bytes, Serialization kind) {
  MessageReader reader(bytes, kind);
  PressureSample sample;
  sample.utime = reader.take_header();
  sample.pressure = reader.take<double>();
  if (const std::string why = problem(reader, sample.utime); !why.empty()) return Failure(why);
  return sample;
}

bool is_velocity_type(std::string_view type) {
  return type == "geometry_msgs/TwistStamped" || type == "geometry_msgs/TwistWithCovarianceStamped";
}

tl::expected<VelocitySample, std::string> decode_velocity(Bytes bytes, Serialization kind) {
  MessageReader reader(bytes, kind);
  VelocitySample sample;
  sample.utime = reader.take_header();
  sample.v_B = reader.take_vector();
  sample.sigma = kDvlSigma;
  if (const std::string why = problem(reader, sample.utime); !why.empty()) return Failure(why);
  return sample;
}

bool is_pose_type(std::string_view type) {
  return has_attitude(type) || type == "geometry_msgs/PointStamped";
}

bool has_attitude(std::string_view type) {
  return type == "geometry_msgs/PoseStamped" || type == "geometry_msgs/TransformStamped" ||
         type == "geometry_msgs/PoseWithCovarianceStamped" || type == "nav_msgs/Odometry";
}

tl::expected<TruePose, std::string> decode_pose(Bytes bytes, std::string_view type,
                                                Serialization kind) {
  MessageReader reader(bytes, kind);
  TruePose pose;
  pose.utime = reader.take_header();
  if (type == "geometry_msgs/TransformStamped" || type == "nav_msgs/Odometry") {
    static_cast<void>(reader.take_text());  // the child's frame
  }
  pose.X_WB.p = reader.take_vector();
  if (has_attitude(type)) pose.X_WB.q = reader.take_quaternion();
  if (const std::string why = problem(reader, pose.utime); !why.empty()) return Failure(why);
  if (is_attitude(pose.X_WB.q)) pose.X_WB.q.normalize();
  return pose;
}

tl::expected<Utime, std::string> decode_stamp(Bytes bytes, Serialization kind) {
  MessageReader reader(bytes, kind);
  const Utime utime = reader.take_header();
  if (const std::string why = problem(reader, utime); !why.empty()) return Failure(why);
  return utime;
}

}  // namespace dive::estimation
