#pragma once
// Dives in a separate process that is killed without warning.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "mission/document/mission.h"
#include "mission/record/journal.h"
#include "mission/simulation/simulated_dive.h"
#include "planning/world/world.h"
#include "vehicle/model.h"

namespace dive::mission::testing {

class KilledDive {
 public:
  /// A mission of two holds, three goals and a payload command, in open water without any solid.
  KilledDive();

  /// Runs the dive to the end in this process, with a journal at `path`.
  DiveResult dive(const std::string& path) const;
  /// The same with a given journal; `observe` gets the outputs of every step after the journal.
  DiveResult dive(JournalWriter& journal,
                  const std::function<void(const StepOutputs&)>& observe) const;
  /// Continues from the journal at `path`; appends its payload commands to `payload`.
  DiveResult resume(const std::string& path, std::vector<std::string>& payload) const;
  /// In a child process, which dies by SIGKILL right after the journal's line number `line`.
  void kill_after_line(const std::string& path, std::int64_t line) const;
  /// In a child process, killed after the given time in microseconds. False if it had ended by
  /// then.
  bool kill_after(const std::string& path, std::int64_t microseconds) const;

  [[nodiscard]] const Mission& mission() const { return mission_; }

 private:
  Mission mission_;
  planning::World world_;
  vehicle::Model model_;
};

/// The text in the first bank of a journal; empty if the file does not exist.
[[nodiscard]] std::string first_bank_of(const std::string& path);

}  // namespace dive::mission::testing
