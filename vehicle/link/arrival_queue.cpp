#include "vehicle/link/arrival_queue.h"

#include <chrono>
#include <utility>

namespace dive::link {
namespace {

std::size_t cost(const Arrival& arrival) { return arrival.packet.size() + ArrivalQueue::kOverhead; }

}  // namespace

bool ArrivalQueue::push(Arrival arrival, std::size_t max_packets) {
  const std::lock_guard lock(mutex_);
  const auto found = usage_.find(arrival.sender.id);
  const Usage none;
  const Usage& used = found == usage_.end() ? none : found->second;
  const auto waiting = used.packets.find(arrival.subscription);
  const std::size_t size = cost(arrival);
  const bool has_count = waiting == used.packets.end() || waiting->second < max_packets;
  const bool has_bytes = bytes_ == 0 || bytes_ + used.bytes + size <= kMaxBytes;
  if (!has_count || !has_bytes) return false;
  Usage& usage = usage_[arrival.sender.id];
  usage.bytes += size;
  ++usage.packets[arrival.subscription];
  bytes_ += size;
  arrivals_.push_back(std::move(arrival));
  arrived_.notify_one();
  return true;
}

std::optional<Arrival> ArrivalQueue::pop() {
  const std::lock_guard lock(mutex_);
  if (arrivals_.empty()) return std::nullopt;
  Arrival arrival = std::move(arrivals_.front());
  arrivals_.pop_front();
  const auto usage = usage_.find(arrival.sender.id);
  usage->second.bytes -= cost(arrival);
  bytes_ -= cost(arrival);
  --usage->second.packets[arrival.subscription];
  if (usage->second.bytes == 0) usage_.erase(usage);
  return arrival;
}

void ArrivalQueue::wait(Utime timeout) {
  std::unique_lock lock(mutex_);
  arrived_.wait_for(lock, std::chrono::microseconds(timeout),
                    [this] { return !arrivals_.empty(); });
}

}  // namespace dive::link
