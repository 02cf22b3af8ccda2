#include "test/mission/record/killed_dive.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <stdexcept>
#include <thread>
#include <utility>

#include <sys/wait.h>
#include <unistd.h>

#include "test/common/file_content.h"

namespace dive::mission::testing {
namespace {

constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="killed">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="none.sdf"/>
  <start x="0" y="0" z="3" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="6" min_altitude="0" clearance="0.6" mission_timeout="300"
          battery_reserve="0.2"/>
  <resume policy="continue"/>
  <states initial="ready">
    <hold id="ready" duration="2">
      <onentry><payload command="lights" once="true"/></onentry>
      <transition event="done.state.ready" target="again"/>
    </hold>
    <state id="swim" initial="first">
      <history id="again" type="deep" initial="first"/>
      <goal_sequence id="first" timeout="100" on_timeout="ascend">
        <goal id="a" x="3" y="0" z="3" z_units="DEPTH"/>
        <goal id="b" x="3" y="3" z="3" z_units="DEPTH"/>
        <goal id="c" x="0" y="3" z="3" z_units="DEPTH"/>
        <transition event="done.state.first" target="ascend">
          <payload command="marker" once="true"/>
        </transition>
      </goal_sequence>
    </state>
    <surface id="ascend">
      <transition event="done.state.ascend" target="surfaced"/>
    </surface>
    <final id="surfaced"/>
  </states>
</mission>)";

DiveResult run(const KilledDive& dive, const planning::World& world, const vehicle::Model& model,
               const DiveSettings& settings, JournalWriter& journal,
               std::vector<std::string>* payload) {
  return simulate_dive(
      dive.mission(), world, model, settings,
      [&](const StepInputs&, const StepOutputs& outputs, const vehicle::GroundTruth&, const auto&) {
        if (payload == nullptr) return;
        for (const ActionRecord& action : outputs.actions) {
          if (action.kind == ActionRecord::Kind::kPayload) payload->push_back(action.text);
        }
      },
      [&](const Executive& executive, const StepOutputs& outputs) {
        journal.keep(executive, outputs);
      });
}

JournalWriter created(const std::string& path, JournalOptions options = {}) {
  auto journal = JournalWriter::create(path, {"digest", 1}, std::move(options));
  if (!journal) throw std::runtime_error(journal.error());
  return std::move(*journal);
}

void wait_for(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
}

}  // namespace

KilledDive::KilledDive() {
  Diagnostics diagnostics;
  std::optional<Mission> mission =
      parse_mission(SourceText("killed.xml", kMission), diagnostics, MapFile::kNotNeeded);
  if (!mission) throw std::runtime_error(render(diagnostics.list().front(), false));
  mission_ = std::move(*mission);
  model_ = *vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
}

DiveResult KilledDive::dive(const std::string& path) const {
  JournalWriter journal = created(path);
  return run(*this, world_, model_, {}, journal, nullptr);
}

DiveResult KilledDive::dive(JournalWriter& journal,
                            const std::function<void(const StepOutputs&)>& observe) const {
  return simulate_dive(
      mission_, world_, model_, {},
      [](const StepInputs&, const StepOutputs&, const auto&, const auto&) {},
      [&](const Executive& executive, const StepOutputs& outputs) {
        journal.keep(executive, outputs);
        observe(outputs);
      });
}

DiveResult KilledDive::resume(const std::string& path, std::vector<std::string>& payload) const {
  auto kept = read_journal(path);
  if (!kept) throw std::runtime_error(kept.error());
  DiveSettings settings;
  if (kept->checkpoint)
    settings.resume = Resume{*kept->checkpoint, kept->trail, kept->trail_spacing_m, 0.0};
  JournalWriter journal = JournalWriter::append(path, *kept);
  return run(*this, world_, model_, settings, journal, &payload);
}

void KilledDive::kill_after_line(const std::string& path, std::int64_t line) const {
  const pid_t child = fork();
  if (child != 0) return wait_for(child);
  JournalOptions options;
  options.on_lines = [line](std::int64_t lines) {
    if (lines == line) std::raise(SIGKILL);
  };
  JournalWriter journal = created(path, std::move(options));
  if (line <= 1) std::raise(SIGKILL);
  run(*this, world_, model_, {}, journal, nullptr);
  journal.close();
  _exit(0);
}

bool KilledDive::kill_after(const std::string& path, std::int64_t microseconds) const {
  const pid_t child = fork();
  if (child == 0) {
    dive(path);
    _exit(0);
  }
  std::this_thread::sleep_for(std::chrono::microseconds(microseconds));
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFSIGNALED(status);
}

std::string first_bank_of(const std::string& path) {
  std::string content = dive::testing::content_of(path);
  content.resize(std::min(content.find('\0'), content.size()));
  return content;
}

}  // namespace dive::mission::testing
