// Replays logs as `dive replay` does, without the rest of the command: the least that has to be
// built to compare another architecture (bench/compare_aarch64.sh).

#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "mission/record/replay.h"

namespace {

using dive::mission::LogReader;
using dive::mission::ReplayReport;

/// The verdict in words; "identical" if every output is.
std::string verdict(const std::string& file) {
  tl::expected<LogReader, std::string> log = LogReader::open(file);
  if (!log) return log.error();
  const tl::expected<ReplayReport, std::string> report = dive::mission::replay(*log);
  if (!report) return report.error();
  if (report->identical) return "identical";
  const std::string& first = report->mathematics_difference.empty()
                                 ? report->first_divergence
                                 : report->mathematics_difference;
  return fmt::format("{} of {} ticks are identical{}{}", report->replayed, report->ticks,
                     first.empty() ? "" : "; first difference at ", first);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Replays logs. Exit status 1 if one is not identical.");
  std::vector<std::string> files;
  app.add_option("LOG", files, "Logs of dives")->required();
  CLI11_PARSE(app, argc, argv);
  int status = 0;
  for (const std::string& file : files) {
    const std::string result = verdict(file);
    fmt::print("{}: {}\n", file, result);
    if (result != "identical") status = 1;
  }
  return status;
}
