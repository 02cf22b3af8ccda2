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

}  // namespace dive
