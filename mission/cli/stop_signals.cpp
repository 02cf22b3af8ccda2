#include "mission/cli/stop_signals.h"

#include <atomic>
#include <csignal>

#include <unistd.h>

namespace dive::mission {
namespace {

// States of a dive as the handler distinguishes them; a signal's number while its abort waits.
constexpr int kBefore = 0;
constexpr int kDiving = -1;
constexpr int kAborting = -2;
constexpr int kEnded = -3;

std::atomic<int> state = kBefore;
static_assert(std::atomic<int>::is_always_lock_free, "handlers may not lock");

void on_signal(int signal) {
  int expected = kDiving;
  if (state.compare_exchange_strong(expected, signal) || expected == kEnded) return;
  _exit(128 + signal);
}

struct sigaction before_term, before_int, before_pipe, before_size;

}  // namespace

StopSignals::StopSignals() {
  state = kBefore;
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGTERM, &action, &before_term);
  sigaction(SIGINT, &action, &before_int);
  action.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &action, &before_pipe);
  sigaction(SIGXFSZ, &action, &before_size);
}

StopSignals::~StopSignals() {
  sigaction(SIGTERM, &before_term, nullptr);
  sigaction(SIGINT, &before_int, nullptr);
  sigaction(SIGPIPE, &before_pipe, nullptr);
  sigaction(SIGXFSZ, &before_size, nullptr);
}

std::optional<OperatorCommand> StopSignals::take() {
  int now = kBefore;
  if (state.compare_exchange_strong(now, kDiving)) return std::nullopt;
  if (now <= 0 || !state.compare_exchange_strong(now, kAborting)) return std::nullopt;
  return now == SIGTERM ? OperatorCommand::kSigterm : OperatorCommand::kSigint;
}

void StopSignals::end_dive() { state = kEnded; }

}  // namespace dive::mission
