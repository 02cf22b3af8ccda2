#pragma once
// The last N values of a quantity by time, with lookup between two entries.

#include <array>
#include <cstddef>
#include <optional>

#include "common/assert.h"
#include "common/clock.h"

namespace dive {

/// Does not allocate after its construction.
template <class T, std::size_t N>
class TimedBuffer {
 public:
  /// The two entries around a time. At the time of an entry both are that entry, and `share` is 0.
  struct Bracket {
    const T* before = nullptr;
    const T* after = nullptr;
    double share = 0.0;  ///< Elapsed fraction of the interval, in [0, 1).
  };

  /// Demands times in non-decreasing order.
  void push(Utime utime, const T& value) {
    DIVE_DEMAND(count_ == 0 || utime >= newest_utime());
    entries_[count_++ % N] = {utime, value};
  }

  [[nodiscard]] bool empty() const { return count_ == 0; }
  /// Demands at least one entry.
  [[nodiscard]] const T& newest() const { return newest_entry().value; }
  [[nodiscard]] Utime newest_utime() const { return newest_entry().utime; }

  /// Empty for a time before the oldest stored entry or after the newest.
  [[nodiscard]] std::optional<Bracket> at(Utime utime) const {
    if (count_ == 0 || utime > newest_utime()) return std::nullopt;
    const std::size_t oldest = count_ > N ? count_ - N : 0;
    std::size_t i = count_ - 1;
    while (i > oldest && entries_[i % N].utime > utime) --i;
    const Entry& before = entries_[i % N];
    if (before.utime > utime) return std::nullopt;
    if (before.utime == utime || i + 1 == count_) return Bracket{&before.value, &before.value, 0.0};
    const Entry& after = entries_[(i + 1) % N];
    return Bracket{&before.value, &after.value,
                   to_seconds(utime - before.utime) / to_seconds(after.utime - before.utime)};
  }

 private:
  struct Entry {
    Utime utime = 0;
    T value{};
  };
  [[nodiscard]] const Entry& newest_entry() const {
    DIVE_DEMAND(count_ > 0);
    return entries_[(count_ - 1) % N];
  }

  std::array<Entry, N> entries_{};
  std::size_t count_ = 0;  ///< Number of pushes so far.
};

}  // namespace dive
