// Structured bindings unpack the values, so that a new member does not compile until it is encoded.

#include "vehicle/link/codec.h"

#include <algorithm>
#include <array>
#include <limits>

#include <dive/command_t.hpp>
#include <dive/depth_t.hpp>
#include <dive/health_t.hpp>
#include <dive/heartbeat_t.hpp>
#include <dive/image_t.hpp>
#include <dive/imu_t.hpp>
#include <dive/operator_answer_t.hpp>
#include <dive/operator_request_t.hpp>
#include <dive/path_t.hpp>
#include <dive/presence_t.hpp>
#include <dive/pseudo_rates_t.hpp>
#include <dive/range_scan_t.hpp>
#include <dive/sim_tick_t.hpp>
#include <dive/truth_t.hpp>
#include <dive/vehicle_command_t.hpp>

#include "vehicle/command_timing.h"
#include "vehicle/link/packet_detail.h"

namespace dive::link {

using namespace detail;

namespace {

static_assert(vehicle::kCommandStale == vehicle_command_t::STALE_MS * Utime{1000});
static_assert(vehicle::kCommandTimeout == vehicle_command_t::TIMEOUT_MS * Utime{1000});
static_assert(vehicle::kSessionTimeout == vehicle_command_t::SESSION_TIMEOUT_MS * Utime{1000});

constexpr Run kImu[] = {bytes(8 + (4 + 3 + 3) * sizeof(double))};
constexpr Run kDepth[] = {bytes(8 + sizeof(double))};
constexpr Run kHealth[] = {bytes(8 + 4 * sizeof(double) + 1)};
constexpr Run kCommand[] = {bytes(8 + 7 * sizeof(double))};
constexpr Run kRates[] = {bytes(8 + 5 * sizeof(double))};
constexpr Run kVehicleCommand[] = {bytes(3 * 8 + 3 + 12 * sizeof(double))};
constexpr Run kTruth[] = {bytes(8 + kPoseSize), texts(kMaxObstacleName, kMaxContacts),
                          bytes(sizeof(double)), text(kMaxObstacleName)};
constexpr Run kSimTick[] = {bytes(8 + 6 + 6 * 8 + 1 + 8)};
constexpr Run kHeartbeat[] = {bytes(5 * 8 + 4 * 4 + 2)};
constexpr Run kRequest[] = {bytes(3 * 8 + 1)};
constexpr Run kAnswer[] = {bytes(2 * 8 + 2)};
constexpr std::size_t kMaxPixels = std::size_t{kMaxImageSide} * kMaxImageSide * 3;
constexpr std::array<Run, 2> image_layout(std::size_t max_pixel_bytes) {
  return {bytes(8 + 2 + 2 * 4), array(1, max_pixel_bytes)};
}
constexpr auto kImage = image_layout(kMaxPixels);
constexpr Run kRange[] = {bytes(8 + 4 * sizeof(float)), array(sizeof(float), 3 * kMaxScanPoints)};
constexpr Run kPresence[] = {bytes(8), array(std::size_t{2} * 8, kMaxEchoes)};
constexpr Run kPath[] = {bytes(8 + sizeof(double)), array(kPoseSize, kMaxPathLength)};

static_assert(std::max({max_size(kImu), max_size(kDepth), max_size(kHealth), max_size(kCommand),
                        max_size(kRates), max_size(kVehicleCommand), max_size(kSimTick),
                        max_size(kHeartbeat), max_size(kRequest), max_size(kAnswer)}) <=
              kMaxFixedPacket);

std::size_t size_of(const ImageFrame& frame) {
  const std::size_t bytes_a_pixel = frame.format == ImageFrame::Format::kRgb8 ? 3 : 1;
  return static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height) *
         bytes_a_pixel;
}

bool is_frame(const ImageFrame& frame) {
  const auto is_side = [](int pixels) { return pixels > 0 && pixels <= kMaxImageSide; };
  return is_side(frame.width) && is_side(frame.height) && frame.camera >= 0 &&
         frame.camera < kCameras && frame.pixels.size() == size_of(frame);
}

bool is_scan(const RangeScan& scan) {
  return scan.origin_B.allFinite() && scan.reach > 0.0F && scan.reach <= kMaxReach &&
         scan.points_B.size() <= kMaxScanPoints;
}

bool read_mode(std::int8_t byte, Mode& mode) {
  mode = byte == vehicle_command_t::RATES ? Mode::kRates : Mode::kDepthAndAngles;
  return byte == vehicle_command_t::RATES || byte == vehicle_command_t::DEPTH_AND_ANGLES;
}

bool read_time(std::int8_t byte, Utime utime, std::optional<Utime>& out) {
  bool is_there = false;
  if (!read_flag(byte, is_there)) return false;
  out = is_there ? std::optional(utime) : std::nullopt;
  return is_there || utime == 0;
}

bool is_count(int samples, Utime last) {
  return samples >= 0 && samples <= std::numeric_limits<std::int8_t>::max() &&
         (samples > 0 || last == 0);
}

}  // namespace

constexpr std::size_t kMaxPresencePacket = max_size(kPresence);
constexpr std::size_t kMaxScanPacket = max_size(kRange);
constexpr std::size_t kMaxTruthPacket = max_size(kTruth);

std::size_t image_packet_size(std::size_t pixel_bytes) {
  return max_size(image_layout(pixel_bytes));
}

bool encode(const ImuSample& sample, Packet& packet) {
  const auto& [utime, q_WB, gyro_B, accel_B] = sample;
  imu_t m;
  m.utime = utime;
  write_quaternion(q_WB, m.q);
  write_vector(gyro_B, m.gyro);
  write_vector(accel_B, m.accel);
  return pack(m, kImu, packet);
}

bool decode(PacketView packet, ImuSample& sample) {
  const auto m = unpack<imu_t>(packet, kImu);
  if (!m) return false;
  sample = {m->utime, read_quaternion(m->q), read_vector(m->gyro), read_vector(m->accel)};
  return true;
}

bool encode(const DepthSample& sample, Packet& packet) {
  const auto& [utime, depth] = sample;
  depth_t m;
  m.utime = utime;
  m.depth = depth;
  return pack(m, kDepth, packet);
}

bool decode(PacketView packet, DepthSample& sample) {
  const auto m = unpack<depth_t>(packet, kDepth);
  if (!m) return false;
  sample = {m->utime, m->depth};
  return true;
}

bool encode(const HealthSample& sample, Packet& packet) {
  const auto& [utime, battery_fraction, temperature, leak, voltage, current] = sample;
  health_t m;
  m.utime = utime;
  m.battery_fraction = battery_fraction;
  m.temperature = temperature;
  m.voltage = voltage;
  m.current = current;
  m.leak = leak ? 1 : 0;
  return pack(m, kHealth, packet);
}

bool decode(PacketView packet, HealthSample& sample) {
  const auto m = unpack<health_t>(packet, kHealth);
  if (!m) return false;
  sample = {m->utime, m->battery_fraction, m->temperature, false, m->voltage, m->current};
  return read_flag(m->leak, sample.leak);
}

bool encode(Utime now, const vehicle::Command& command, Packet& packet) {
  const auto& [v, h, d, o] = command;
  command_t m;
  m.utime = now;
  m.v = v;
  m.h = h;
  m.d = d;
  write_quaternion(o, m.o);
  return pack(m, kCommand, packet);
}

bool decode(PacketView packet, vehicle::Command& command) {
  const auto m = unpack<command_t>(packet, kCommand);
  if (!m) return false;
  command = {m->v, m->h, m->d, read_quaternion(m->o)};
  return true;
}

bool encode(Utime now, const vehicle::PseudoRates& rates, Packet& packet) {
  const auto& [surge, heave, roll, pitch, yaw] = rates;
  pseudo_rates_t m;
  m.utime = now;
  m.surge = surge;
  m.heave = heave;
  m.roll = roll;
  m.pitch = pitch;
  m.yaw = yaw;
  return pack(m, kRates, packet);
}

bool decode(PacketView packet, vehicle::PseudoRates& rates) {
  const auto m = unpack<pseudo_rates_t>(packet, kRates);
  if (!m) return false;
  rates = {m->surge, m->heave, m->roll, m->pitch, m->yaw};
  return true;
}

bool encode(const ImageFrame& frame, Packet& packet) {
  const auto& [utime, camera, format, width, height, pixels] = frame;
  if (!is_frame(frame)) return false;
  image_t m;
  m.utime = utime;
  m.camera = static_cast<std::int8_t>(camera);
  m.format = static_cast<std::int8_t>(format);
  m.width = width;
  m.height = height;
  m.size = static_cast<std::int32_t>(pixels.size());
  m.data = pixels;
  return pack(m, kImage, packet);
}

bool decode(PacketView packet, ImageFrame& frame) {
  auto m = unpack<image_t>(packet, kImage);
  if (!m) return false;
  frame.utime = m->utime;
  frame.camera = static_cast<int>(m->camera);
  frame.width = m->width;
  frame.height = m->height;
  frame.pixels = std::move(m->data);
  return read_enum(m->format, ImageFrame::kLastFormat, frame.format) && is_frame(frame);
}

bool encode(const RangeScan& scan, Packet& packet) {
  const auto& [utime, origin_B, reach, points, landmarks] = scan;
  static_cast<void>(landmarks);  // a range camera sends none
  if (!is_scan(scan)) return false;
  range_scan_t m;
  m.utime = utime;
  std::copy_n(origin_B.data(), 3, m.origin);
  m.max_range = reach;
  m.num_values = static_cast<std::int32_t>(3 * points.size());
  m.points.reserve(3 * points.size());
  for (const Eigen::Vector3f& p : points) m.points.insert(m.points.end(), p.data(), p.data() + 3);
  return pack(m, kRange, packet);
}

bool decode(PacketView packet, RangeScan& scan) {
  const auto m = unpack<range_scan_t>(packet, kRange);
  if (!m || m->points.size() % 3 != 0) return false;
  scan.utime = m->utime;
  scan.origin_B = {m->origin[0], m->origin[1], m->origin[2]};
  scan.reach = m->max_range;
  scan.points_B.clear();
  scan.points_B.reserve(m->points.size() / 3);
  for (std::size_t i = 0; i < m->points.size(); i += 3) {
    scan.points_B.emplace_back(m->points[i], m->points[i + 1], m->points[i + 2]);
  }
  return is_scan(scan);
}

bool encode(const VehicleCommand& value, Packet& packet) {
  const auto& [utime, sequence, source, mode, command, rates, session_id, phase] = value;
  const auto& [v, h, d, o] = command;
  const auto& [surge, heave, roll, pitch, yaw] = rates;
  vehicle_command_t m;
  m.utime = utime;
  m.session_id = static_cast<std::int64_t>(session_id);
  m.sequence = sequence;
  m.phase = static_cast<std::int8_t>(phase);
  m.source = static_cast<std::int8_t>(source);
  m.mode = mode == Mode::kRates ? vehicle_command_t::RATES : vehicle_command_t::DEPTH_AND_ANGLES;
  m.v = v;
  m.h = h;
  m.d = d;
  write_quaternion(o, m.o);
  m.surge = surge;
  m.heave = heave;
  m.roll = roll;
  m.pitch = pitch;
  m.yaw = yaw;
  return pack(m, kVehicleCommand, packet);
}

bool decode(PacketView packet, VehicleCommand& command) {
  const auto m = unpack<vehicle_command_t>(packet, kVehicleCommand);
  if (!m) return false;
  command.utime = m->utime;
  command.sequence = m->sequence;
  command.command = {m->v, m->h, m->d, read_quaternion(m->o)};
  command.rates = {m->surge, m->heave, m->roll, m->pitch, m->yaw};
  command.session_id = static_cast<std::uint64_t>(m->session_id);
  return read_enum(m->source, kLastSource, command.source) &&
         read_enum(m->phase, vehicle::kLastExitPhase, command.phase) &&
         read_mode(m->mode, command.mode);
}

bool encode(const Truth& truth, Packet& packet) {
  const auto& [utime, X_WB, contacts, min_clearance_m, nearest] = truth;
  if (contacts.size() > kMaxContacts) return false;
  truth_t m;
  m.utime = utime;
  write_pose(X_WB, m.pose);
  m.n = static_cast<std::int32_t>(contacts.size());
  m.contacts = contacts;
  m.min_clearance = min_clearance_m;
  m.nearest = nearest;
  return pack(m, kTruth, packet);
}

bool decode(PacketView packet, Truth& truth) {
  auto m = unpack<truth_t>(packet, kTruth);
  if (!m) return false;
  truth = {m->utime, read_pose(m->pose), std::move(m->contacts), m->min_clearance,
           std::move(m->nearest)};
  return true;
}

bool encode(const SimTick& tick, Packet& packet) {
  const auto& [utime, ahrs, depth, health, range, left, right, imu_samples, last_imu] = tick;
  if (!is_count(imu_samples, last_imu)) return false;
  sim_tick_t m;
  m.utime = utime;
  m.ahrs = ahrs ? 1 : 0;
  m.depth = depth ? 1 : 0;
  m.health = health ? 1 : 0;
  m.range = range ? 1 : 0;
  m.left = left ? 1 : 0;
  m.right = right ? 1 : 0;
  m.ahrs_utime = ahrs.value_or(0);
  m.depth_utime = depth.value_or(0);
  m.health_utime = health.value_or(0);
  m.range_utime = range.value_or(0);
  m.left_utime = left.value_or(0);
  m.right_utime = right.value_or(0);
  m.imu_samples = static_cast<std::int8_t>(imu_samples);
  m.imu_utime = last_imu;
  return pack(m, kSimTick, packet);
}

bool decode(PacketView packet, SimTick& tick) {
  const auto m = unpack<sim_tick_t>(packet, kSimTick);
  if (!m) return false;
  tick.utime = m->utime;
  tick.imu_samples = static_cast<int>(m->imu_samples);
  tick.last_imu = m->imu_utime;
  return is_count(tick.imu_samples, tick.last_imu) &&
         read_time(m->ahrs, m->ahrs_utime, tick.ahrs) &&
         read_time(m->depth, m->depth_utime, tick.depth) &&
         read_time(m->health, m->health_utime, tick.health) &&
         read_time(m->range, m->range_utime, tick.range) &&
         read_time(m->left, m->left_utime, tick.left) &&
         read_time(m->right, m->right_utime, tick.right);
}

bool encode(const Heartbeat& heartbeat, Packet& packet) {
  const auto& [utime, session_id, challenge, counter, ticks, refused, has_key, finished] =
      heartbeat;
  const auto& [auth_failed, replayed, stale, rate_limited] = refused;
  heartbeat_t m;
  m.utime = utime;
  m.session_id = static_cast<std::int64_t>(session_id);
  m.challenge = static_cast<std::int64_t>(challenge);
  m.counter = counter;
  m.ticks = ticks;
  m.auth_failed = auth_failed;
  m.replayed = replayed;
  m.stale = stale;
  m.rate_limited = rate_limited;
  m.has_key = has_key ? 1 : 0;
  m.finished = finished ? 1 : 0;
  return pack(m, kHeartbeat, packet);
}

bool decode(PacketView packet, Heartbeat& heartbeat) {
  const auto m = unpack<heartbeat_t>(packet, kHeartbeat);
  if (!m) return false;
  heartbeat = {m->utime,
               static_cast<std::uint64_t>(m->session_id),
               static_cast<std::uint64_t>(m->challenge),
               m->counter,
               m->ticks,
               {m->auth_failed, m->replayed, m->stale, m->rate_limited},
               false,
               false};
  return read_flag(m->has_key, heartbeat.has_key) && read_flag(m->finished, heartbeat.finished);
}

bool encode(const OperatorRequest& request, Packet& packet) {
  const auto& [session_id, counter, challenge, command] = request;
  operator_request_t m;
  m.session_id = static_cast<std::int64_t>(session_id);
  m.counter = counter;
  m.challenge = static_cast<std::int64_t>(challenge);
  m.command = static_cast<std::int8_t>(command);
  return pack(m, kRequest, packet);
}

bool decode(PacketView packet, OperatorRequest& request) {
  const auto m = unpack<operator_request_t>(packet, kRequest);
  if (!m) return false;
  request.session_id = static_cast<std::uint64_t>(m->session_id);
  request.counter = m->counter;
  request.challenge = static_cast<std::uint64_t>(m->challenge);
  return read_enum(m->command, kLastTopsideCommand, request.command);
}

bool encode(const OperatorAnswer& answer, Packet& packet) {
  const auto& [session_id, counter, command, result] = answer;
  operator_answer_t m;
  m.session_id = static_cast<std::int64_t>(session_id);
  m.counter = counter;
  m.command = static_cast<std::int8_t>(command);
  m.result = static_cast<std::int8_t>(result);
  return pack(m, kAnswer, packet);
}

bool decode(PacketView packet, OperatorAnswer& answer) {
  const auto m = unpack<operator_answer_t>(packet, kAnswer);
  if (!m) return false;
  answer.session_id = static_cast<std::uint64_t>(m->session_id);
  answer.counter = m->counter;
  return read_enum(m->command, kLastTopsideCommand, answer.command) &&
         read_enum(m->result, kLastRequestResult, answer.result);
}

bool encode(const Path& path, Packet& packet) {
  const auto& [utime, clearance, waypoints] = path;
  if (waypoints.size() > kMaxPathLength) return false;
  path_t m;
  m.utime = utime;
  m.clearance = clearance;
  write_poses(waypoints, m.n, m.waypoints);
  return pack(m, kPath, packet);
}

bool decode(PacketView packet, Path& path) {
  const auto m = unpack<path_t>(packet, kPath);
  if (!m) return false;
  path.utime = m->utime;
  path.clearance_m = m->clearance;
  read_poses(m->waypoints, path.waypoints);
  return true;
}

bool encode(const Presence& presence, Packet& packet) {
  const auto& [challenge, echoes] = presence;
  if (echoes.size() > kMaxEchoes) return false;
  presence_t m;
  m.challenge = static_cast<std::int64_t>(challenge);
  m.n = static_cast<std::int32_t>(echoes.size());
  m.echoes.resize(echoes.size());
  for (std::size_t i = 0; i < echoes.size(); ++i) {
    m.echoes[i].sender = static_cast<std::int64_t>(echoes[i].sender);
    m.echoes[i].challenge = static_cast<std::int64_t>(echoes[i].challenge);
  }
  return pack(m, kPresence, packet);
}

bool decode(PacketView packet, Presence& presence) {
  const auto m = unpack<presence_t>(packet, kPresence);
  if (!m) return false;
  presence.challenge = static_cast<std::uint64_t>(m->challenge);
  presence.echoes.clear();
  for (const presence_echo_t& echo : m->echoes) {
    presence.echoes.push_back(
        {static_cast<std::uint64_t>(echo.sender), static_cast<std::uint64_t>(echo.challenge)});
  }
  return true;
}

}  // namespace dive::link
