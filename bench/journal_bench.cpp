// Cost of the journal: one commit by the writer's thread, and a restart after a day of dive.

#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include <benchmark/benchmark.h>

#include "mission/record/journal_bank.h"
#include "mission/record/journal_file.h"

namespace dive::mission {
namespace {

std::string journal_path() {
  return (std::filesystem::temp_directory_path() / "dive_journal_bench.journal").string();
}

std::unique_ptr<JournalFile> begin() {
  JournalOptions options;
  options.open = [] { return create_record_file(journal_path()); };
  JournalState state;
  state.header = {"digest", 1};
  auto file = std::make_unique<JournalFile>(std::move(options), state, 1);
  if (!file->begin()) throw std::runtime_error("the journal cannot be written");
  return file;
}

std::string usual_commit() {
  Checkpoint checkpoint;
  checkpoint.active = {"mission", "through_the_wreck", "the_second_room"};
  checkpoint.active_s = {1000.0 / 3.0, 200.0 / 3.0, 10.0 / 3.0};
  checkpoint.X_WB.p = {1.0 / 3.0, 2.0 / 3.0, -10.0 / 3.0};
  std::string commit(1, static_cast<char>(JournalEntry::kCommit));
  commit.append(to_json_text(checkpoint));
  return commit;
}

void take(JournalFile& file, const std::string& entry) {
  file.take({reinterpret_cast<const std::uint8_t*>(entry.data()), entry.size()});
}

void BM_Commit(benchmark::State& state) {
  const std::unique_ptr<JournalFile> file = begin();
  const std::string commit = usual_commit();
  for (auto _ : state) take(*file, commit);
  std::filesystem::remove(journal_path());
}
BENCHMARK(BM_Commit);

// 24 h at 0.4 m/s: 69,120 breadcrumbs and, here, as many commits. The size no longer grows.
void BM_ResumeAfterADay(benchmark::State& state) {
  {
    const std::unique_ptr<JournalFile> file = begin();
    const std::string commit = usual_commit();
    for (int i = 0; i < 69'120; ++i) {
      file->take(
          breadcrumb_bytes({{50.0 * std::cos(0.01 * i), 50.0 * std::sin(0.01 * i), -3.0}, true}));
      take(*file, commit);
    }
  }
  for (auto _ : state) {
    const auto journal = read_journal(journal_path());
    benchmark::DoNotOptimize(to_text(*journal));
  }
  state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(journal_path()));
  std::filesystem::remove(journal_path());
}
BENCHMARK(BM_ResumeAfterADay)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dive::mission
