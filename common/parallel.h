#pragma once
// Independent work on all cores.

#include <cstddef>
#include <functional>

namespace dive {

/// `jobs` threads, or one per core when that is 0.
[[nodiscard]] int thread_count(int jobs);

/// Calls work(0) to work(count - 1) once each on `threads` threads, starting them in increasing
/// order, and returns when all have ended. After an exception it starts no further call and
/// rethrows the first one.
void run_in_parallel(std::size_t count, int threads, const std::function<void(std::size_t)>& work);

/// The same with a number of calls that is decided on the way: before each, `continues(i)` is asked
/// by one thread at a time, and no call starts after it has returned false. Returns the number of
/// calls.
std::size_t run_in_parallel_while(const std::function<bool(std::size_t)>& continues, int threads,
                                  const std::function<void(std::size_t)>& work);

}  // namespace dive
