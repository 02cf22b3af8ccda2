#include "common/background_output.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "common/assert.h"
#include "common/priority.h"

namespace dive {
namespace {

constexpr std::size_t kLengthSize = 4;  // bytes before each block
constexpr auto kPoll = std::chrono::milliseconds(1);

}  // namespace

// A ring with one producer and one consumer. `head` and `tail` count all bytes ever queued and
// taken; each is written by one side only.
struct BackgroundOutput::State {
  State(std::size_t capacity, WhenFull when_full_in, Sink sink_in)
      : ring(capacity), when_full(when_full_in), sink(std::move(sink_in)) {}

  void copy_in(std::uint64_t at, const void* from, std::size_t size) {
    const std::size_t begin = at % ring.size();
    const std::size_t first = std::min(size, ring.size() - begin);
    std::memcpy(ring.data() + begin, from, first);
    if (size > first) {
      std::memcpy(ring.data(), static_cast<const std::uint8_t*>(from) + first, size - first);
    }
  }
  void copy_out(std::uint64_t at, void* to, std::size_t size) const {
    const std::size_t begin = at % ring.size();
    const std::size_t first = std::min(size, ring.size() - begin);
    std::memcpy(to, ring.data() + begin, first);
    if (size > first)
      std::memcpy(static_cast<std::uint8_t*>(to) + first, ring.data(), size - first);
  }

  void wake_consumer() {
    signal.fetch_add(1);
    signal.notify_one();
  }

  // The consumer.
  void run() {
    set_normal_priority();
    while (true) {
      const std::uint32_t seen = signal.load();
      while (tail.load() != head.load() && !abandoned) pass_one();
      if (stopping || abandoned) return;
      signal.wait(seen);
    }
  }
  void pass_one() {
    const std::uint64_t at = tail.load();
    std::uint32_t size = 0;
    copy_out(at, &size, kLengthSize);
    block.resize(size);
    copy_out(at + kLengthSize, block.data(), size);
    sink(block);
    done.fetch_add(1);
    tail.store(at + kLengthSize + size);
    tail.notify_one();
  }

  std::vector<std::uint8_t> ring;
  const WhenFull when_full;
  const Sink sink;
  std::vector<std::uint8_t> block;  // Of the consumer, reused.
  std::atomic<std::uint64_t> head = 0;
  std::atomic<std::uint64_t> tail = 0;
  std::atomic<std::uint64_t> done = 0;
  std::atomic<std::uint32_t> signal = 0;
  std::atomic<bool> stopping = false;
  std::atomic<bool> abandoned = false;
  std::uint64_t pushed = 0;
  bool closed = false;
  std::thread thread;
};

BackgroundOutput::BackgroundOutput(std::size_t capacity, WhenFull when_full, Sink sink)
    : state_(std::make_shared<State>(capacity, when_full, std::move(sink))) {
  DIVE_DEMAND(capacity > kLengthSize);
  state_->thread = std::thread([state = state_] { state->run(); });
}

BackgroundOutput::~BackgroundOutput() { close(); }

bool BackgroundOutput::push(std::span<const std::uint8_t> block) {
  State& state = *state_;
  if (state.closed) return false;
  const std::size_t needed = kLengthSize + block.size();
  const bool fits = needed <= state.ring.size();
  const std::uint64_t head = state.head.load();
  std::uint64_t tail = state.tail.load();
  if (state.when_full == WhenFull::kDrop) {
    if (!fits || head - tail + needed > state.ring.size()) return false;
  } else {
    while (fits ? head - tail + needed > state.ring.size() : head != tail) {
      state.tail.wait(tail);
      tail = state.tail.load();
    }
  }
  ++state.pushed;
  if (!fits) {  // The queue is empty, and the thread waits for this one.
    state.sink(block);
    state.done.fetch_add(1);
    return true;
  }
  const auto size = static_cast<std::uint32_t>(block.size());
  state.copy_in(head, &size, kLengthSize);
  state.copy_in(head + kLengthSize, block.data(), block.size());
  state.head.store(head + needed);
  state.wake_consumer();
  return true;
}

bool BackgroundOutput::push(std::string_view text) {
  return push({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::uint64_t BackgroundOutput::pushed() const { return state_->pushed; }
std::uint64_t BackgroundOutput::done() const { return state_->done.load(); }

bool BackgroundOutput::drain(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (state_->done.load() < state_->pushed) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(kPoll);
  }
  return true;
}

bool BackgroundOutput::close(std::chrono::milliseconds timeout) {
  State& state = *state_;
  if (state.closed) return state.done.load() == state.pushed;
  const bool is_drained = drain(timeout);
  state.closed = true;
  (is_drained ? state.stopping : state.abandoned) = true;
  state.wake_consumer();
  if (is_drained) {
    state.thread.join();
  } else {
    state.thread.detach();
  }
  return is_drained;
}

}  // namespace dive
