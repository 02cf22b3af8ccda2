#pragma once
// The channels of the link.

namespace dive::link::channel {

// Sender and message type.
inline constexpr const char* kAhrs = "DIVE_AHRS";               ///< Vehicle: imu_t
inline constexpr const char* kDepth = "DIVE_DEPTH";             ///< Vehicle: depth_t
inline constexpr const char* kHealth = "DIVE_HEALTH";           ///< Vehicle: health_t
inline constexpr const char* kImage = "DIVE_IMAGE";             ///< Vehicle: image_t
inline constexpr const char* kImu = "DIVE_IMU";                 ///< Vehicle, 200 Hz: imu_t
inline constexpr const char* kRange = "DIVE_RANGE";             ///< Vehicle: range_scan_t
inline constexpr const char* kSimTick = "DIVE_SIM_TICK";        ///< Simulated vehicle: sim_tick_t
inline constexpr const char* kTruth = "DIVE_SIM_TRUTH";         ///< Simulated vehicle: truth_t
inline constexpr const char* kCommand = "DIVE_COMMAND";         ///< vehicle_command_t
inline constexpr const char* kHeartbeat = "DIVE_HEARTBEAT";     ///< Executive: heartbeat_t
inline constexpr const char* kStatus = "DIVE_STATUS";           ///< Executive: status_t
inline constexpr const char* kEstimate = "DIVE_ESTIMATE";       ///< Executive: state_estimate_t
inline constexpr const char* kExitPath = "DIVE_EXIT_PATH";      ///< Executive: exit_path_t
inline constexpr const char* kPath = "DIVE_PATH";               ///< Executive: path_t
inline constexpr const char* kPayload = "DIVE_PAYLOAD";         ///< Executive: action_t
inline constexpr const char* kRequest = "DIVE_OPERATOR";        ///< Topside: operator_request_t
inline constexpr const char* kAnswer = "DIVE_OPERATOR_ANSWER";  ///< Executive: operator_answer_t
inline constexpr const char* kPresence = "DIVE_PRESENCE";       ///< All, with a key: presence_t

}  // namespace dive::link::channel
