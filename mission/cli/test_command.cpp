#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/parallel.h"
#include "mission/cli/commands.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/output.h"
#include "mission/cli/recording.h"
#include "mission/cli/terminal.h"
#include "mission/cli/work_progress.h"
#include "mission/record/log.h"
#include "mission/scenario/dive_record.h"
#include "mission/scenario/evaluation.h"
#include "mission/scenario/junit.h"
#include "mission/scenario/scenario.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

/// One scenario and its results.
struct Trial {
  std::string path;
  Diagnostics diagnostics;  ///< For the scenario and its mission.
  std::optional<Scenario> scenario;
  std::shared_ptr<const LoadedMission> loaded;
  std::string log;      ///< File of the log; empty: none.
  Result file;          ///< Keeps its name for it.
  std::string problem;  ///< Error in writing the log.
  DiveResult result;
  std::vector<ExpectationResult> failed;       ///< Unmet expectations.
  std::vector<ExpectationResult> cannot_fail;  ///< Met, and also met when negated.
  bool insensitive = false;                    ///< Passed although its script was disabled.
  std::size_t expectations = 0;
  double seconds = 0.0;  ///< Duration of the dive's computation.

  [[nodiscard]] bool is_valid() const { return scenario && loaded; }
  [[nodiscard]] bool passed() const {
    return is_valid() && failed.empty() && cannot_fail.empty() && !insensitive && problem.empty();
  }
  [[nodiscard]] std::string name() const {
    return scenario ? scenario->id : fs::path(path).stem().string();
  }
};

/// The files named, those of a folder in alphabetical order; prints an error and returns nothing if
/// one does not exist or a folder has none.
std::optional<std::vector<std::string>> files_of(const std::vector<std::string>& named) {
  std::vector<std::string> files;
  for (const std::string& name : named) {
    std::error_code error;
    if (!fs::is_directory(name, error)) {
      files.push_back(name);
      continue;
    }
    std::vector<std::string> inside;
    for (fs::directory_iterator entry(name, error), end; !error && entry != end;
         entry.increment(error)) {
      if (entry->path().extension() == ".xml") inside.push_back(entry->path().string());
    }
    if (error || inside.empty()) {
      complain(fmt::format("{}: {}", name, error ? error.message() : "holds no scenario (*.xml)"));
      return std::nullopt;
    }
    std::ranges::sort(inside);
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

/// Caches missions: many scenarios use the same one, and each is loaded once.
class Missions {
 public:
  explicit Missions(planning::Resources resources) : resources_(resources) {}

  std::shared_ptr<const LoadedMission> get(const std::string& path, Diagnostics& diagnostics) {
    const auto [at, is_new] = shelf_.try_emplace(path);
    Shelved& shelved = at->second;
    if (is_new) {
      if (std::optional<LoadedMission> loaded = load(path, resources_, shelved.diagnostics)) {
        shelved.loaded = std::make_shared<const LoadedMission>(std::move(*loaded));
      }
    }
    for (const Diagnostic& diagnostic : shelved.diagnostics.list()) diagnostics.add(diagnostic);
    return shelved.loaded;
  }

 private:
  struct Shelved {
    std::shared_ptr<const LoadedMission> loaded;
    Diagnostics diagnostics;
  };
  planning::Resources resources_;
  std::map<std::string, Shelved> shelf_;
};

void read(Trial& trial, Missions& missions) {
  if (!is_text_of(FileKind::kScenario, trial.path, trial.diagnostics)) return;
  trial.scenario = load_scenario(trial.path, trial.diagnostics);
  if (!trial.scenario) return;
  Scenario& scenario = *trial.scenario;
  trial.loaded = missions.get(scenario.mission_path, trial.diagnostics);
  if (!trial.loaded) {
    trial.diagnostics.error("SCN-MISSION", scenario.source, scenario.mission_file.span,
                            fmt::format("the mission '{}' is not accepted", scenario.mission_path),
                            "see above, or ask 'dive check'");
    return;
  }
  const LoadedMission& loaded = *trial.loaded;
  if (!has_simulation_map(loaded.mission)) {
    trial.diagnostics.error("SCN-MISSION", scenario.source, scenario.mission_file.span,
                            "the mission has an unknown environment and no simulated world",
                            "write simulation_map=\"maps/NAME.sdf\" at <map>");
    trial.loaded.reset();
    return;
  }
  if (!suit_to_mission(scenario, loaded.mission, loaded.world, trial.diagnostics)) {
    trial.loaded.reset();
  }
}

/// Every log in the folder is named after its scenario; the names count up. Prints an error and
/// returns the exit status if one cannot be created.
int create_logs(std::vector<Trial>& trials, const std::string& folder) {
  if (folder.empty()) return kExitSuccess;
  create_folder_of(folder + "/");
  for (Trial& trial : trials) {
    if (!trial.is_valid()) continue;
    const fs::path name = fs::path(folder) / (trial.scenario->id + ".lcmlog");
    tl::expected<OutputFile, OutputError> file = OutputFile::create_numbered(name.string());
    if (!file) return report(file.error());
    trial.log = file->path();
    trial.file.emplace(std::move(*file));
  }
  return kExitSuccess;
}

DiveRecord dive_and_log(Trial& trial, Script script) {
  const Scenario& scenario = *trial.scenario;
  const LoadedMission& loaded = *trial.loaded;
  std::optional<LogWriter> log;
  if (trial.file) {
    auto created = LogWriter::create(trial.log, header_of(loaded, scenario.seed));
    if (created) {
      log = std::move(*created);
    } else {
      trial.problem = fmt::format("{}: {}", trial.log, created.error());
    }
  }
  DiveRecord record = dive_scenario(
      scenario, loaded.mission, loaded.world, loaded.simulated_world, loaded.model, script,
      [&](const StepInputs& inputs, const StepOutputs& outputs, const vehicle::GroundTruth& truth,
          const TickContacts& contacts) {
        if (log) log->write(inputs, outputs, truth_record(truth, contacts));
      });
  if (log && !log->close()) {
    trial.problem = fmt::format("{}: the log is not complete (disk full?)", trial.log);
  }
  return record;
}

void try_out(Trial& trial, const TestArguments& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const DiveRecord record =
      dive_and_log(trial, arguments.disable_scripts ? Script::kDisabled : Script::kPlayed);
  trial.result = record.result;
  trial.result.observed_map = {};  // the report does not use the map
  trial.result.observed_points = {};
  for (const ExpectationResult& result : evaluate(*trial.scenario, record)) {
    ++trial.expectations;
    if (!result.passed) trial.failed.push_back(result);
  }
  const bool has_script = !trial.scenario->steps.empty() || trial.scenario->diver;
  if (arguments.disable_scripts && has_script) {
    trial.insensitive = trial.failed.empty();
    trial.failed.clear();
  }
  if (arguments.negate && trial.failed.empty()) {
    trial.cannot_fail = insensitive_expectations(*trial.scenario, record);
  }
  trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!trial.file) return;
  if (trial.passed() && !arguments.keep_all) {
    trial.log.clear();
  } else {
    trial.file->keep();
  }
  trial.file.reset();  // removes the log unless it is kept
}

std::string at(const Trial& trial, const ExpectationResult& result) {
  return fmt::format("{}:{}:{}", trial.path, result.span.line, result.span.column);
}

std::vector<std::string> complaints_of(const Trial& trial) {
  std::vector<std::string> lines;
  for (const ExpectationResult& failed : trial.failed) {
    lines.push_back(fmt::format("{}: expected {}; actual: {}", at(trial, failed), failed.expected,
                                failed.actual));
  }
  for (const ExpectationResult& idle : trial.cannot_fail) {
    lines.push_back(fmt::format(
        "{}: this expectation cannot fail: its negation passes too; expected {}; actual: {}",
        at(trial, idle), idle.expected, idle.actual));
  }
  if (trial.insensitive) {
    lines.push_back(trial.path +
                    ": passes with its script disabled: the expectations do not test the script");
  }
  if (!trial.problem.empty()) lines.push_back(trial.problem);
  return lines;
}

void print_trial(const Trial& trial, const TestArguments& arguments) {
  if (!trial.is_valid()) {
    print_diagnostics(trial.diagnostics);
    print(fmt::format("INVALID  {}  ({})", trial.name(), trial.path));
    return;
  }
  const DiveResult& dive = trial.result;
  print(fmt::format("{:<7}  {:<34} {:6.1f} s  {:<8} {} expectation(s){}",
                    trial.passed() ? "ok" : "FAILED", trial.name(), dive.duration_s, dive.outcome,
                    trial.expectations,
                    arguments.negate && trial.passed() ? ", each fails when negated" : ""));
  if (trial.passed()) return;
  if (!trial.scenario->description.empty()) print("  " + trial.scenario->description);
  for (const std::string& line : complaints_of(trial)) print("  " + line);
  print(trial.log.empty() ? "  for a log of it: dive test " + trial.path + " --keep DIR"
                          : "  why it went so: dive explain " + trial.log);
}

/// Runs all valid scenarios, several in parallel, and prints them in their order.
void try_all(std::vector<Trial>& trials, const TestArguments& arguments) {
  std::mutex telling;
  std::size_t printed = 0;
  std::size_t ended = 0;
  std::vector<bool> done(trials.size(), false);
  SteadyClock clock;
  WorkProgress progress(clock, "testing", arguments.json);
  const auto tell = [&](std::size_t index) {
    const std::lock_guard lock(telling);
    done[index] = true;
    progress.clear();
    for (; printed < trials.size() && done[printed]; ++printed) {
      if (!arguments.json) print_trial(trials[printed], arguments);
    }
    progress.show(static_cast<double>(++ended) / static_cast<double>(trials.size()));
  };
  run_in_parallel(trials.size(), thread_count(arguments.jobs), [&](std::size_t i) {
    if (trials[i].is_valid()) try_out(trials[i], arguments);
    tell(i);
  });
}

std::vector<TestCase> cases_of(const std::vector<Trial>& trials) {
  std::vector<TestCase> cases;
  for (const Trial& trial : trials) {
    TestCase test;
    test.name = trial.name();
    test.folder = fs::path(trial.path).parent_path().string();
    test.seconds = trial.seconds;
    test.failures = complaints_of(trial);
    if (!trial.is_valid()) {
      const auto& list = trial.diagnostics.list();
      test.error = list.empty() ? "invalid" : render(list.front(), false);
    }
    cases.push_back(std::move(test));
  }
  return cases;
}

nlohmann::ordered_json to_json(const Trial& trial) {
  nlohmann::ordered_json failures = nlohmann::ordered_json::array();
  const auto add = [&](const std::vector<ExpectationResult>& results, const char* kind) {
    for (const ExpectationResult& result : results) {
      failures.push_back({{"kind", kind},
                          {"file", trial.path},
                          {"line", result.span.line},
                          {"column", result.span.column},
                          {"expected", result.expected},
                          {"actual", result.actual}});
    }
  };
  add(trial.failed, "failed");
  add(trial.cannot_fail, "cannot_fail");
  nlohmann::ordered_json json = {{"id", trial.name()},
                                 {"file", trial.path},
                                 {"valid", trial.is_valid()},
                                 {"ok", trial.passed()},
                                 {"insensitive", trial.insensitive},
                                 {"expectations", trial.expectations},
                                 {"failures", std::move(failures)},
                                 {"diagnostics", mission::to_json(trial.diagnostics)}};
  if (!trial.log.empty()) json["log"] = trial.log;
  if (!trial.problem.empty()) json["problem"] = trial.problem;
  if (trial.is_valid()) {
    json["outcome"] = trial.result.outcome;
    json["final_state"] = trial.result.final_state;
    json["duration_s"] = trial.result.duration_s;
    json["collision_list"] = mission::to_json(trial.result.collisions);
  }
  return json;
}

int conclude(const std::vector<Trial>& trials, Result& junit, const TestArguments& arguments) {
  const auto count = [&](auto what) { return std::ranges::count_if(trials, what); };
  const auto passed = count(&Trial::passed);
  const auto valid = count(&Trial::is_valid);
  const auto total = static_cast<std::ptrdiff_t>(trials.size());
  if (arguments.json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const Trial& trial : trials) list.push_back(to_json(trial));
    print_json({{"ok", passed == total},
                {"passed", passed},
                {"failed", valid - passed},
                {"invalid", total - valid},
                {"scenarios", std::move(list)}});
  } else {
    print(fmt::format("{} scenario(s): {} ok, {} failed, {} invalid", total, passed, valid - passed,
                      total - valid));
  }
  if (junit) {
    const int status = write_result(junit, to_junit(cases_of(trials)));
    if (status != kExitSuccess) return status;
  }
  const bool is_kept =
      std::ranges::all_of(trials, [](const Trial& t) { return t.problem.empty(); });
  if (!is_kept) return kExitInternal;
  if (valid != total) return kExitUsage;
  return passed == total ? kExitSuccess : kExitFailed;
}

}  // namespace

int run_tests(const TestArguments& arguments) {
  if (arguments.list_rules) {
    print_rules({scenario_rules()}, arguments.json);
    return kExitSuccess;
  }
  if (arguments.disable_scripts && arguments.negate) {
    complain("--disable-scripts and --negate do not go together");
    return kExitUsage;
  }
  if (arguments.keep_all && arguments.keep.empty()) {
    complain("--keep-all needs --keep DIR");
    return kExitUsage;
  }
  const std::optional<std::vector<std::string>> files = files_of(arguments.scenarios);
  if (!files) return kExitUsage;
  std::vector<Trial> trials(files->size());
  Missions missions(resources(arguments.allow_outside));
  for (std::size_t i = 0; i < trials.size(); ++i) {
    trials[i].path = (*files)[i];
    read(trials[i], missions);
  }
  tl::expected<Result, int> junit = open_result(arguments.junit, arguments.force);
  if (!junit) return junit.error();
  if (const int status = create_logs(trials, arguments.keep); status != kExitSuccess) return status;
  try_all(trials, arguments);
  return conclude(trials, *junit, arguments);
}

}  // namespace dive::mission
