#pragma once
// Work off the control thread whose result is given a stated time after it was asked for, never
// when the machine happens to be ready: so that a simulated dive is the same on every machine.

#include <chrono>
#include <deque>
#include <future>
#include <optional>
#include <utility>

#include "common/clock.h"
#include "common/priority.h"

namespace dive::mission {

/// What happens when a result is due and the worker is late: in simulation it is waited for, so
/// that a dive does not depend on the machine; on a vehicle nothing may hold up the control loop.
enum class Late { kWait, kNotYet };

/// One task at a time, each on a thread of normal priority: its result may come late, a command may
/// not. What a task refers to must outlive the worker, and is the task's alone until
/// has_finished().
template <class Result>
class DelayedWorker {
 public:
  explicit DelayedWorker(Late late) : late_(late) {}
  ~DelayedWorker() {
    if (task_.valid()) task_.wait();
  }
  DelayedWorker(const DelayedWorker&) = delete;
  DelayedWorker& operator=(const DelayedWorker&) = delete;

  /// start() would not wait for the task before.
  [[nodiscard]] bool has_finished() const {
    return !task_.valid() || task_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }
  /// The caller may start() now: on a vehicle only once the task before has finished.
  [[nodiscard]] bool may_start() const { return late_ == Late::kWait || has_finished(); }

  /// Waits for the task before, whose result is kept until it is due.
  template <class Task>
  void start(Utime due, Task&& task) {
    collect();
    due_ = due;
    task_ = std::async(std::launch::async, [task = std::forward<Task>(task)]() mutable {
      run_as_others();
      return task();
    });
  }

  /// Waits for the task: its result is among waiting().
  void collect() {
    if (task_.valid()) results_.push_back({due_, task_.get()});
  }

  /// The oldest result, once it is due. Throws what its task threw.
  [[nodiscard]] std::optional<Result> poll(Utime now) {
    const bool is_due = task_.valid() && now >= due_;
    if ((late_ == Late::kWait && is_due) || has_finished()) collect();
    if (results_.empty() || now < results_.front().due) return std::nullopt;
    std::optional<Result> result = std::move(results_.front().result);
    results_.pop_front();
    return result;
  }

  struct Waiting {
    Utime due = 0;
    Result result;
  };
  /// Results that are not due yet, or were not asked for, oldest first.
  [[nodiscard]] const std::deque<Waiting>& waiting() const { return results_; }
  /// Nothing is under way, and nothing waits.
  [[nodiscard]] bool is_idle() const { return !task_.valid() && results_.empty(); }
  /// Forgets what waits.
  void drop_waiting() { results_.clear(); }

 private:
  Late late_;
  std::future<Result> task_;
  Utime due_ = 0;
  std::deque<Waiting> results_;
};

}  // namespace dive::mission
