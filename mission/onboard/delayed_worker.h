#pragma once
// Work on a second thread whose result is delivered a stated time after the request, not when the
// machine is ready, so that a simulated dive is the same on every machine.

#include <chrono>
#include <deque>
#include <exception>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include "common/clock.h"
#include "common/priority.h"

namespace dive::mission {

/// Behaviour when a result is due and the worker is late: the simulation waits, so that a dive does
/// not depend on the machine; on a vehicle nothing may delay the control loop.
enum class OnLate { kBlock, kPoll };

/// Runs one task at a time on a thread of normal priority: a result may be late, a command may not.
/// Objects used by a task must outlive the worker and belong to the task until has_finished().
template <class Result>
class DelayedWorker {
 public:
  explicit DelayedWorker(OnLate late) : late_(late) {}
  ~DelayedWorker() {
    if (task_.valid()) task_.wait();
  }
  DelayedWorker(const DelayedWorker&) = delete;
  DelayedWorker& operator=(const DelayedWorker&) = delete;

  /// True if start() would not wait for the last task.
  [[nodiscard]] bool has_finished() const {
    return !task_.valid() || task_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }
  /// True if the caller may start() now: on a vehicle only after the last task has finished.
  [[nodiscard]] bool may_start() const { return late_ == OnLate::kBlock || has_finished(); }

  /// Waits for the last task, whose result is kept until it is due, and starts the next.
  template <class Task>
  void start(Utime due, Task&& task) {
    collect();
    due_ = due;
    task_ = std::async(std::launch::async, [task = std::forward<Task>(task)]() mutable {
      set_normal_priority();
      return task();
    });
  }

  /// Waits for the task and adds its result to waiting(). A simulation throws the exception of a
  /// task; on a vehicle, whose loop must go on, there is no result then, as of a silent sensor, and
  /// take_failure() has the message.
  void collect() {
    if (!task_.valid()) return;
    try {
      results_.push_back({due_, task_.get()});
    } catch (const std::exception& error) {
      if (late_ == OnLate::kBlock) throw;
      failure_ = error.what();
    }
  }

  /// The message of the last task that threw, once.
  [[nodiscard]] std::optional<std::string> take_failure() {
    return std::exchange(failure_, std::nullopt);
  }

  /// The oldest result, once it is due; throws as collect() does.
  [[nodiscard]] std::optional<Result> poll(Utime now) {
    const bool is_due = task_.valid() && now >= due_;
    if ((late_ == OnLate::kBlock && is_due) || has_finished()) collect();
    if (results_.empty() || now < results_.front().due) return std::nullopt;
    std::optional<Result> result = std::move(results_.front().result);
    results_.pop_front();
    return result;
  }

  struct Waiting {
    Utime due = 0;
    Result result;
  };
  /// Results that are not due or not polled yet, oldest first.
  [[nodiscard]] const std::deque<Waiting>& waiting() const { return results_; }
  /// True without a task and without waiting results.
  [[nodiscard]] bool is_idle() const { return !task_.valid() && results_.empty(); }
  /// Drops the waiting results.
  void drop_waiting() { results_.clear(); }

 private:
  OnLate late_;
  std::future<Result> task_;
  Utime due_ = 0;
  std::deque<Waiting> results_;
  std::optional<std::string> failure_;
};

}  // namespace dive::mission
