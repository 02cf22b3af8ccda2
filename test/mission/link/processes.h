#pragma once
// Executive, vehicle, supervisor and topside as separate processes, over UDP multicast on this
// machine. Skipped with a message if the machine does not route multicast.
//
// Nothing here depends on the speed of the machine. Tests that depend on the course of a dive run
// in lock-step. Only tests about real time run in real time: killed processes, operator requests,
// and clock changes. They wait for events, in open water, and need far less time than their limits.

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/mission/link/process.h"

namespace dive::mission::testing {

/// Factors on real time for tests that need real time. At 2 a tick of the executive takes some 3 %
/// of its budget; 4 is for dives most of which are the same in every test.
inline constexpr const char* kPace = "2";
inline constexpr const char* kFastPace = "4";

/// Limit in seconds for processes that end by themselves: against hanging, not a measurement.
inline constexpr double kLong = 900.0;

/// A mission of missions/, by its path there without ".xml".
std::string mission(const std::string& name);

class Processes : public ::testing::Test {
 protected:
  void SetUp() override;

  /// Waits until the vehicle's sensors have run for the given vehicle time.
  void wait_for_vehicle_time(double seconds) const;
  /// Waits until the vehicle's sensors have set their clock back, and some checkpoints longer.
  void wait_until_clock_is_set_back() const;

  /// Starts `dive` with these words, on this test's multicast group unless they name another.
  [[nodiscard]] std::unique_ptr<Process> dive(const std::string& name,
                                              std::vector<std::string> words) const;
  /// Sends a topside command and returns its exit status.
  int say(const std::string& name, std::vector<std::string> words) const;

  /// A file of this test.
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
  /// Calibration of the simulated vehicle's cameras.
  [[nodiscard]] std::string cameras(const std::string& mission) const;
  /// The mission murk in a shallower bay with a thick post on the straight path: the vehicle's
  /// motion there depends on its observations.
  [[nodiscard]] std::string murk() const;
  /// The mission pool3 with another element before `place`.
  [[nodiscard]] std::string pool_with(const std::string& element, const std::string& place) const;
  /// The mission pool3, which only the holder of the key may abort.
  [[nodiscard]] std::string pool_aborted_by_key() const;

  std::string folder_;
  std::string url_;
  std::string far_url_;
  std::vector<std::string> launcher_;  ///< Words before the command.

 private:
  [[nodiscard]] bool hears_itself() const;
};

/// One of the processes ends, hangs or loses its disk during the dive.
class Death : public Processes {
 protected:
  /// In open water.
  void begin(const std::vector<std::string>& pace = {"--time-factor", kPace},
             const std::vector<std::string>& vehicle = {});
  void begin(const std::string& name, double until_s, const std::vector<std::string>& pace,
             const std::vector<std::string>& vehicle = {});
  /// In the hold of the wreck: the way out leads through the gash in her side.
  void begin_inside();

  /// Waits until the supervisor has said so.
  void wait_for_supervisor(const std::string& words) const;

  /// The mission pool3, which a restarted executive continues.
  [[nodiscard]] std::string resumable() const;

  std::unique_ptr<Process> vehicle_;
  std::unique_ptr<Process> supervisor_;
  std::unique_ptr<Process> executive_;
};

}  // namespace dive::mission::testing
