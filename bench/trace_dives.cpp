// Dive logs as text, one file for each: the executive's inputs and decisions, and every command to
// the vehicle, to the last bit. Two revisions of the programme with equal behaviour write the same
// text, whatever the format of their logs; compare_dives.sh makes and compares such files. Messages
// for people are left out, because they may be reworded.
//     trace_dives --output traces dive-runs/window-seed1.lcmlog

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bench/run_study.h"
#include "mission/record/log.h"

namespace dive::bench {
namespace {

namespace fs = std::filesystem;

std::string text_of(const Eigen::Vector3d& v) {
  return fmt::format("{} {} {}", v.x(), v.y(), v.z());
}
std::string text_of(const Eigen::Quaterniond& q) {
  return fmt::format("{} {} {} {}", q.w(), q.x(), q.y(), q.z());
}

class Trace {
 public:
  explicit Trace(const fs::path& file) : file_(file) {
    if (!file_) throw std::runtime_error(fmt::format("cannot write {}", file.string()));
  }

  void add(const mission::LoggedTick& tick) {
    now_ = tick.inputs.now;
    add_inputs(tick.inputs);
    add_decisions(tick.outputs);
    add_motion(tick.outputs);
  }

 private:
  template <class... Values>
  void line(const char* kind, fmt::format_string<Values...> format, Values&&... values) {
    fmt::print(file_, "{} {} {}\n", now_, kind,
               fmt::format(format, std::forward<Values>(values)...));
  }

  void add_inputs(const mission::StepInputs& inputs) {
    if (inputs.plan) {
      const planning::PlanResult& plan = inputs.plan->plan;
      line("plan", "{} {} {} {} {}", inputs.plan->id, planning::to_string(plan.status),
           plan.clearance_m, plan.length_m, plan.waypoints.size());
    }
    if (inputs.operator_command) line("operator", "{}", to_string(*inputs.operator_command));
  }

  void add_decisions(const mission::StepOutputs& outputs) {
    for (const auto& transition : outputs.transitions) {
      line("transition", "{} -> {} by '{}'", transition.from, transition.to, transition.event);
    }
    for (const auto& failsafe : outputs.failsafes) {
      line("failsafe", "{} {} ({})", failsafe.rung, failsafe.cause, failsafe.competing);
    }
    for (const auto& action : outputs.actions) {
      using Kind = mission::ActionRecord::Kind;
      if (action.kind == Kind::kNote) continue;
      line(action.kind == Kind::kLog ? "log" : "payload", "{}", action.text);
    }
    if (outputs.plan_query) {
      const mission::PlanQuery& query = *outputs.plan_query;
      line("query", "{} {} {} {} {} {} {}", query.id, query.state, text_of(query.request.start.p),
           text_of(query.request.goal.p), query.request.limits.clearance, query.request.seed,
           query.request.previous.size());
    }
    const std::string status =
        fmt::format("{} {} {} {}", outputs.status.state, outputs.status.rung,
                    outputs.status.segment, outputs.status.finished ? "finished" : "under way");
    if (status != status_) line("status", "{}", status);
    status_ = status;
  }

  void add_motion(const mission::StepOutputs& outputs) {
    const vehicle::Command& command = outputs.command;
    line("command", "{} {} {}", command.v, command.d, text_of(command.o));
    const vehicle::PseudoRates& rates = outputs.rates;
    line("rates", "{} {} {} {} {}", rates.surge, rates.heave, rates.roll, rates.pitch, rates.yaw);
    line("at", "{} {}", text_of(outputs.estimate.X_WB.p), text_of(outputs.estimate.X_WB.q));
  }

  std::ofstream file_;
  Utime now_ = 0;
  std::string status_;
};

void trace(const std::string& log, const fs::path& folder) {
  auto reader = mission::LogReader::open(log);
  if (!reader) throw std::runtime_error(reader.error());
  Trace trace(folder / fs::path(log).filename().replace_extension(".txt"));
  while (const auto tick = reader->next()) trace.add(*tick);
  if (!reader->gaps().empty()) throw std::runtime_error(fmt::format("{} is damaged", log));
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("Dive logs as text");
  std::vector<std::string> logs;
  std::string output = ".";
  app.add_option("LOG", logs, "Dive logs")->required();
  app.add_option("--output", output, "Folder for the text files");
  CLI11_PARSE(app, argc, argv);
  return dive::bench::run_study([&] {
    std::filesystem::create_directories(output);
    for (const std::string& log : logs) dive::bench::trace(log, output);
  });
}
