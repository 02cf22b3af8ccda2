#include "mission/report/sample_list.h"

namespace dive::mission {

void SampleList::add(Utime now, DiveSample sample, bool is_marked) {
  if (samples_.size() >= capacity_) thin_out();
  if (now >= next_) next_ = now + period_;
  samples_.push_back(std::move(sample));
  is_marked_.push_back(is_marked);
}

// Marks are dropped where they are most of the samples, so that the list always shrinks.
void SampleList::thin_out() {
  period_ *= 2;
  std::size_t marked = 0;
  for (const bool is_marked : is_marked_) marked += is_marked ? 1 : 0;
  const bool keeps_marks = marked < capacity_ / 2;
  std::size_t kept = 0;
  bool is_odd = false;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const bool stays = keeps_marks && is_marked_[i];
    if (!stays) is_odd = !is_odd;
    if (!stays && is_odd) continue;
    if (kept != i) samples_[kept] = std::move(samples_[i]);
    is_marked_[kept++] = stays;
  }
  samples_.resize(kept);
  is_marked_.resize(kept);
}

}  // namespace dive::mission
