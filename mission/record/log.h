#pragma once
// The dive log: an LCM event log (lcm-logger's format, so lcm-spy and lcm-logplayer read it), with
// types from vehicle/messages/*.lcm. Channels are named DIVE_IN_*, DIVE_OUT_*, DIVE_TRUTH; the
// first event is DIVE_HEADER, and DIVE_TICK closes each tick with the number and the digest of its
// events. Timestamps are the tick's utime, event numbers count from 0: same dive, same file, byte
// for byte.

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "mission/executive/io.h"
#include "vehicle/link/codec.h"

namespace dive::mission {

/// Everything needed to build the same executive again.
struct LogHeader {
  std::string version;  ///< Of dive.
  std::uint64_t seed = 0;
  std::string mission_name;  ///< File name without folder.
  std::string mission_xml;
  std::string map_name;
  std::string map_xml;
  std::string map_meshes;  ///< Convex pieces of the meshes the map refers to: MeshSource::bundle().
  std::string vehicle_urdf;
  std::string resume;  ///< The journal that the dive went on from; empty: it began anew.
  std::optional<double> resume_gap_s;  ///< Resume::gap_s.
  std::string digest;  ///< FNV-1a 64 of the four texts, hex; filled in by the writer.
};

using TruthRecord = link::Truth;

/// One tick as read back.
struct LoggedTick {
  StepInputs inputs;
  StepOutputs outputs;
  std::optional<TruthRecord> truth;
};

class LogWriter {
 public:
  /// Fails with a sentence when the file cannot be created or the header not be written.
  [[nodiscard]] static tl::expected<LogWriter, std::string> create(const std::string& path,
                                                                   LogHeader header);
  LogWriter(LogWriter&&) noexcept;
  LogWriter& operator=(LogWriter&&) noexcept;
  ~LogWriter();

  /// Writes one tick: inputs, outputs, truth, in a fixed order, and hands it to the system at once.
  /// False, then and ever after, once the disk refuses or something cannot be represented (a text
  /// over 64 KiB or with a zero byte, more than 16,384 waypoints, a map update beyond its bounds);
  /// the dive goes on.
  bool write(const StepInputs& inputs, const StepOutputs& outputs,
             const std::optional<TruthRecord>& truth);
  /// False when anything was lost. Nothing can be written afterwards.
  bool close();

 private:
  struct Impl;
  explicit LogWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

class LogReader {
 public:
  /// Fails with a sentence: no such file, not an LCM log, no header, header damaged.
  [[nodiscard]] static tl::expected<LogReader, std::string> open(const std::string& path);
  LogReader(LogReader&&) noexcept;
  ~LogReader();

  [[nodiscard]] const LogHeader& header() const;
  /// The next whole tick; nothing at the end. A torn tail, or damage anywhere, ends the log and
  /// sets torn(): garbage never throws, and memory stays in proportion to the size of the file.
  [[nodiscard]] std::optional<LoggedTick> next();
  [[nodiscard]] bool torn() const;
  /// Events of the header and of the ticks returned.
  [[nodiscard]] std::int64_t events_read() const;

 private:
  struct Impl;
  explicit LogReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The first output that differs between what a log says and what a replay gave, as
/// "channel.field: logged A, replayed B"; empty when bit-identical (NaN equals the same NaN).
[[nodiscard]] std::string first_difference(const StepOutputs& logged, const StepOutputs& replayed);

}  // namespace dive::mission
