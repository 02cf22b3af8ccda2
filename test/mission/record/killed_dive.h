#pragma once
// Dives in a process of its own that is killed without warning.

#include <cstdint>
#include <string>
#include <vector>

#include "mission/check/simulated_dive.h"
#include "mission/document/mission.h"
#include "mission/record/journal.h"
#include "planning/world/world.h"
#include "vehicle/model.h"

namespace dive::mission::testing {

class KilledDive {
 public:
  /// A mission of two holds, three goals and a payload command, in open water without anything
  /// solid.
  KilledDive();

  /// Dives it to the end in this process, with a journal at `path`.
  DiveResult dive(const std::string& path) const;
  /// Goes on from the journal at `path`; the payload commands it then gives are added to `payload`.
  DiveResult resume(const std::string& path, std::vector<std::string>& payload) const;
  /// In a child, which dies by SIGKILL right after the journal's line number `line` ...
  void kill_after_line(const std::string& path, std::int64_t line) const;
  /// ... or after so many microseconds. False when it was over by then.
  bool kill_after(const std::string& path, std::int64_t microseconds) const;

  [[nodiscard]] const Mission& mission() const { return mission_; }

 private:
  Mission mission_;
  planning::World world_;
  vehicle::Model model_;
};

/// A file's content; empty when there is none.
[[nodiscard]] std::string content_of(const std::string& path);

}  // namespace dive::mission::testing
