#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/check/check.h"
#include "mission/check/simulated_dive.h"
#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/picture.h"
#include "mission/cli/terminal.h"
#include "mission/record/journal.h"
#include "mission/record/log.h"
#include "mission/record/log_digest.h"
#include "planning/world/scene.h"

namespace dive::mission {
namespace {

// Once a second of dive time on a terminal, every ten elsewhere.
class DiveProgress {
 public:
  void observe(const StepInputs& inputs, const Status& status) {
    if (inputs.now < next_) return;
    next_ = inputs.now + (line_.on_terminal() ? 1 : 10) * kMicrosecondsPerSecond;
    const std::string leg = status.leg.empty() ? "" : " -> " + status.leg;
    const std::string clearance =
        status.clearance_m > 0.0 ? fmt::format("{:.2f} m", status.clearance_m) : "-";
    line_.show(fmt::format(
        "{:6.1f} s  {:<28} to go {:5.1f} m {:4.0f} s  depth {:4.1f} m  "
        "clearance {}{}",
        to_seconds(inputs.now), status.state + leg, status.distance_to_go_m, status.time_to_go_s,
        status.depth_m, clearance, status.rung == "none" ? "" : "  [" + status.rung + "]"));
  }

 private:
  ProgressLine line_;
  Utime next_ = 0;
};

std::string default_log_path(const Mission& mission, std::uint64_t seed) {
  return fmt::format("dive-runs/{}-seed{}.lcmlog", mission.id, seed);
}

void create_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code ignored;  // what is wrong with the folder shows when the file is created
  if (!folder.empty()) std::filesystem::create_directories(folder, ignored);
}

std::optional<LogWriter> open_log(const std::string& path, const LogHeader& header) {
  tl::expected<LogWriter, std::string> writer = LogWriter::create(path, header);
  if (!writer) {
    complain(fmt::format("{}: {}", path, writer.error()));
    return std::nullopt;
  }
  return std::move(*writer);
}

/// A new journal, or the old one and what to go on from in `settings`; complains and is empty when
/// that is impossible.
std::optional<JournalWriter> open_journal(const std::string& path, bool resume, LogHeader& header,
                                          DiveSettings& settings) {
  const auto refuse = [&](const std::string& why) {
    complain(why);
    return std::nullopt;
  };
  const JournalHeader ours{log_digest(header), header.seed};
  if (!resume) {
    tl::expected<JournalWriter, std::string> writer = JournalWriter::create(path, ours);
    if (!writer) return refuse(writer.error());
    return std::move(*writer);
  }
  tl::expected<Journal, std::string> journal = read_journal(path, &header.resume);
  if (!journal) return refuse(journal.error());
  if (journal->header.digest != ours.digest) {
    return refuse(fmt::format("'{}' is of another mission, map or vehicle", path));
  }
  settings.seed = header.seed = journal->header.seed;
  if (journal->committed) {
    settings.resume = Resume{std::move(*journal->committed), std::move(journal->trail), 0.0};
  }
  tl::expected<JournalWriter, std::string> writer = JournalWriter::append(path);
  if (!writer) return refuse(writer.error());
  return std::move(*writer);
}

void print_verdict(const DiveResult& result, const std::string& log) {
  print(fmt::format("{}: {} in state {}{}", result.outcome == "success" ? "SUCCESS" : "NOT DONE",
                    result.outcome, result.final_state,
                    result.cause.empty() ? "" : " (" + result.cause + ")"));
  print(fmt::format("  {:.0f} s, {:.1f} m swum, {} plan(s) of which {} replan(s), {:.1f} Wh",
                    result.duration_s, result.distance_m, result.plans, result.replans,
                    result.energy_wh));
  print(fmt::format(
      "  nearest to anything {:.2f} m, {} collision(s), surfaced {:.2f} m from where "
      "it believed to be (one sigma {:.2f} m)",
      result.min_clearance_m, result.collisions, result.estimate_error_m, result.estimate_sigma_m));
  print("  log " + log);
}

}  // namespace

int run_dive(const RunArguments& arguments) {
  DiveSettings settings;
  settings.seed = arguments.seed;
  if (arguments.leak_at_s >= 0.0)
    settings.faults.push_back({FaultKind::kLeak, arguments.leak_at_s});
  for (const std::string& written : arguments.faults) {
    const std::optional<Fault> fault = parse_fault(written);
    if (!fault) return kExitUsage;
    settings.faults.push_back(*fault);
  }
  const std::optional<vehicle::Conditions> conditions = parse_conditions(arguments.conditions);
  if (!conditions) return kExitUsage;
  settings.conditions = *conditions;

  Diagnostics diagnostics;
  const std::optional<LoadedMission> loaded = load(arguments.mission, diagnostics);
  if (!loaded) {
    print_diagnostics(diagnostics);
    if (arguments.json) print_json({{"outcome", "failure"}, {"diagnostics", to_json(diagnostics)}});
    return kExitUsage;
  }
  const std::string log_path =
      arguments.log.empty() ? default_log_path(loaded->mission, arguments.seed) : arguments.log;
  LogHeader header = header_of(*loaded, arguments.seed);
  const std::string journal_path =
      arguments.journal.empty() ? log_path + ".journal" : arguments.journal;
  create_folder_of(log_path);
  std::optional<JournalWriter> journal =
      open_journal(journal_path, arguments.resume, header, settings);
  if (!journal) return kExitUsage;
  std::optional<LogWriter> log = open_log(log_path, header);
  if (!log) return kExitUsage;

  DivePicture picture;
  if (!arguments.svg.empty()) {
    const planning::Scene scene(loaded->world);
    picture =
        picture_of_plan(fmt::format("{}: dive with seed {}", loaded->mission.id, arguments.seed),
                        loaded->world, loaded->model.hull, loaded->mission.limits.clearance.value,
                        plan_route(nominal_route(loaded->mission, scene), loaded->world,
                                   loaded->model.hull, settings.planner, arguments.seed));
  }
  PictureRecorder recorder(picture);
  bool log_complete = true;
  bool journal_complete = true;
  DiveResult result;
  {
    DiveProgress progress;
    result = simulate_dive(
        loaded->mission, loaded->world, loaded->model, settings,
        [&](const StepInputs& inputs, const StepOutputs& outputs,
            const vehicle::GroundTruth& truth) {
          log_complete &= log->write(inputs, outputs, TruthRecord{truth.utime, truth.X_WB});
          if (!arguments.json) progress.observe(inputs, outputs.status);
          if (!arguments.svg.empty()) recorder.observe(inputs, outputs, truth);
        },
        [&](const Executive& executive, const StepOutputs& outputs) {
          journal_complete = journal->keep(executive, outputs);
        });
  }
  log_complete &= log->close();
  if (!journal_complete) {
    complain(fmt::format("{}: the journal is not complete (disk full?)", journal_path));
  }
  if (!log_complete) complain(fmt::format("{}: the log is not complete (disk full?)", log_path));

  if (arguments.json) {
    nlohmann::ordered_json json = to_json(result);
    json["log"] = log_path;
    json["seed"] = arguments.seed;
    print_json(json);
  } else {
    print_verdict(result, log_path);
  }
  if (!arguments.svg.empty() && !write_file(arguments.svg, render_svg(picture))) return kExitUsage;
  return result.outcome == "success" && log_complete ? kExitSuccess : kExitFailed;
}

}  // namespace dive::mission
