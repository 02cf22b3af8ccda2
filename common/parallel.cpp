#include "common/parallel.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace dive {

int thread_count(int jobs) {
  if (jobs > 0) return jobs;
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

void run_in_parallel(std::size_t count, int threads, const std::function<void(std::size_t)>& work) {
  const std::size_t needed = std::min(count, static_cast<std::size_t>(std::max(threads, 1)));
  run_in_parallel_while([count](std::size_t i) { return i < count; }, static_cast<int>(needed),
                        work);
}

std::size_t run_in_parallel_while(const std::function<bool(std::size_t)>& continues, int threads,
                                  const std::function<void(std::size_t)>& work) {
  std::mutex taking;
  std::size_t next = 0;
  bool is_over = false;
  std::exception_ptr failure;
  const auto take_work = [&] {
    try {
      while (true) {
        std::size_t i = 0;
        {
          const std::lock_guard lock(taking);
          is_over = is_over || !continues(next);
          if (is_over) return;
          i = next++;
        }
        work(i);
      }
    } catch (...) {
      const std::lock_guard lock(taking);
      is_over = true;
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> workers;
    workers.reserve(static_cast<std::size_t>(std::max(threads, 0)));
    for (int i = 0; i < threads; ++i) workers.emplace_back(take_work);
  }  // joins
  if (failure) std::rethrow_exception(failure);
  return next;
}

}  // namespace dive
