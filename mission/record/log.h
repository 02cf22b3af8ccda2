#pragma once
// The dive log: an LCM event log (lcm-logger's format, so lcm-spy and lcm-logplayer read it), with
// types from vehicle/messages/*.lcm. Channels are named DIVE_IN_*, DIVE_OUT_*, DIVE_TRUTH; the
// first event is DIVE_HEADER, and DIVE_TICK closes each tick with the number of its events.
// Timestamps are the tick's utime, event numbers count from 0: same dive, same file, byte for byte.
// Every event carries a checksum (log_frame.h).

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "common/background_output.h"
#include "common/clock.h"
#include "mission/executive/io.h"
#include "mission/record/record_file.h"
#include "vehicle/link/codec.h"

namespace dive::mission {

/// Everything needed to rebuild the same executive.
struct LogHeader {
  std::string version;      ///< Version of dive.
  std::string mathematics;  ///< mathematics() of the process that dived.
  std::uint64_t seed = 0;
  std::string mission_name;  ///< File name without folder.
  std::string mission_xml;
  std::string map_name;
  std::string map_xml;
  std::string map_meshes;  ///< Convex pieces of the meshes the map refers to: MeshSource::bundle().
  std::string vehicle_urdf;
  std::string resume;  ///< Journal from which the dive continued; empty: a new dive.
  std::optional<double> resume_gap_s;  ///< Resume::gap_s.
  /// How the mission was checked before the dive: "bundle" and its hash; "unchecked", by the
  /// operator's choice, alone or after a bundle; empty: a mission file without a bundle.
  std::string check = {};
};

using TruthRecord = link::Truth;

/// One tick read from the log.
struct LoggedTick {
  StepInputs inputs;
  StepOutputs outputs;
  std::optional<TruthRecord> truth;
};

/// A part of a log without complete ticks, because events in it are damaged or missing.
struct LogGap {
  /// Time of the last tick before the gap; 0 at the beginning of the log.
  Utime from = 0;
  std::optional<Utime> to;   ///< Time of the first tick after the gap; empty: the log has none.
  std::uint64_t offset = 0;  ///< File offset of the event with the first damaged byte.
  /// Bytes from there to the next complete tick, or to the end of the file.
  std::uint64_t bytes = 0;
};

struct LogOptions {
  WhenFull when_full = WhenFull::kWait;
  /// A dive that is under way goes on without its log if the file cannot be created or its header
  /// written: the writer tries again once a second, and the ticks until then are lost.
  bool is_optional = false;
  /// Opens the file; empty: creates the file at `path`. Called on the writer's thread too.
  OpenRecordFile open = {};
};

/// Ticks are encoded by the caller and written by another thread through a queue of 32 MiB (kDrop)
/// or 1 MiB (kWait).
class LogWriter {
 public:
  /// The error is a sentence: the file cannot be created or the header cannot be written.
  [[nodiscard]] static tl::expected<LogWriter, std::string> create(const std::string& path,
                                                                   const LogHeader& header,
                                                                   LogOptions options = {});
  LogWriter(LogWriter&&) noexcept;
  LogWriter& operator=(LogWriter&&) noexcept;
  ~LogWriter();

  /// Queues one tick: inputs, outputs, truth, in a fixed order. Returns false if it is lost: the
  /// queue is full, or a value cannot be represented (a text over 64 KiB or with a zero byte, more
  /// than 16,384 waypoints, a map update beyond its bounds, more than 256 obstacles touched at
  /// once, more than 4096 events). Event numbers count what is lost, so that readers report a gap.
  bool write(const StepInputs& inputs, const StepOutputs& outputs,
             const std::optional<TruthRecord>& truth);
  /// Number of ticks lost so far, those that the disk refused included.
  [[nodiscard]] std::int64_t lost() const;
  /// Reason of the last loss by the disk; empty without one.
  [[nodiscard]] std::string disk_error() const;
  /// Waits for the disk, for at most ten seconds. Returns false if anything was lost. Nothing can
  /// be written afterwards.
  bool close();

 private:
  struct Impl;
  explicit LogWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

class LogReader {
 public:
  /// The error is a sentence: no such file, no valid event in it, a header of another version.
  [[nodiscard]] static tl::expected<LogReader, std::string> open(const std::string& path);
  LogReader(LogReader&&) noexcept;
  ~LogReader();

  /// Empty if the header is damaged.
  [[nodiscard]] const std::optional<LogHeader>& header() const;
  /// The next complete tick; empty at the end. Damage is skipped up to the next complete tick and
  /// reported as a gap. Invalid data never throw; memory stays in proportion to the size of the
  /// file.
  [[nodiscard]] std::optional<LoggedTick> next();
  /// `show` is called after each tick with the share of the file that was read.
  void observe(std::function<void(double share)> show);
  /// The gaps before the tick that next() returned last; all gaps at the end.
  [[nodiscard]] const std::vector<LogGap>& gaps() const;
  /// True if the log ends within its last tick, as when the vehicle fails while writing; that is
  /// not damage.
  [[nodiscard]] bool torn() const;
  /// Number of events in the header and the returned ticks.
  [[nodiscard]] std::int64_t events_read() const;

 private:
  struct Impl;
  explicit LogReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The first output that differs between a log and its replay, as "channel.field: logged A,
/// replayed B"; empty if bit-identical (NaN equals the same NaN).
[[nodiscard]] std::string first_difference(const StepOutputs& logged, const StepOutputs& replayed);

}  // namespace dive::mission
