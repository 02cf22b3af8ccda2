#include "vehicle/link/intake.h"

#include <algorithm>
#include <utility>

#include "vehicle/link/channels.h"

namespace dive::link {

std::size_t Intake::subscribe(std::string channel, std::size_t max_bytes, Access access) {
  const std::lock_guard lock(mutex_);
  subscriptions_.push_back({std::move(channel), max_bytes, access});
  return subscriptions_.size() - 1;
}

void Intake::find_matches(std::string_view channel) {
  matches_.clear();
  if (key_ && channel == channel::kPresence) return;
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < subscriptions_.size(); ++i) {
    const Subscription& subscription = subscriptions_[i];
    if (subscription.channel == channel) {
      matches_.push_back({i, subscription.max_bytes, subscription.access});
    }
  }
}

// Greatest size of its packet with a trailer; 0: the channel is not subscribed.
std::size_t Intake::max_bytes(std::string_view channel) const {
  if (key_ && channel == channel::kPresence) return kMaxPresencePacket + kTrailerSize;
  const auto largest = std::ranges::max_element(matches_, {}, &Match::max_bytes);
  return largest == matches_.end() ? 0 : largest->max_bytes + kTrailerSize;
}

void Intake::take(std::span<const std::uint8_t> bytes, std::uint64_t address, Utime now) {
  const std::optional<Datagram> datagram = parse_datagram(bytes);
  if (!datagram) return;
  if (datagram->fragment == 0) {
    find_matches(datagram->channel);
    const std::size_t most = max_bytes(datagram->channel);
    if (most == 0) return;
    if (datagram->packet_size > most) {
      ++malformed_;
      return;
    }
    if (datagram->fragments == 1) {
      if (datagram->data.size() == datagram->packet_size) {
        take_packet(datagram->channel, datagram->data, address, now);
      }
      return;
    }
  }
  const std::size_t most = datagram->fragment == 0 ? datagram->packet_size : 0;
  const auto complete = assembly_.add(address, is_trusted(address), *datagram, most);
  if (!complete) return;
  find_matches(complete->channel);
  take_packet(complete->channel, complete->packet, address, now);
}

void Intake::take_packet(std::string_view channel, PacketView packet, std::uint64_t address,
                         Utime now) {
  if (key_ && channel == channel::kPresence) return receive_presence(packet, address, now);
  if (matches_.empty()) return;
  const std::optional<Sender> sender = identify(channel, packet, address, now);
  if (!sender) return;
  const PacketView message = without_trailer(packet);
  for (const Match& match : matches_) deliver(match, *sender, message);
}

void Intake::receive_presence(PacketView packet, std::uint64_t address, Utime now) {
  const std::optional<Trailer> trailer = authenticate(*key_, channel::kPresence, packet);
  Presence presence;
  if (!trailer || !decode(without_trailer(packet), presence)) return;
  trust(address);
  peers_.receive(*trailer, presence, now);
}

std::optional<Sender> Intake::identify(std::string_view channel, PacketView packet,
                                       std::uint64_t address, Utime now) {
  if (!key_) return Sender{address, Role::kObserver, Trust::kAnonymous};
  const std::optional<Trailer> trailer = authenticate(*key_, channel, packet);
  if (!trailer || !may_publish(trailer->role, channel)) return Sender{};
  if (trailer->sender == self_) return std::nullopt;
  switch (peers_.accept(*trailer, matches_.front().subscription, now)) {
    case Peers::Freshness::kFresh:
      trust(address);
      return Sender{trailer->sender, trailer->role, Trust::kAuthentic};
    case Peers::Freshness::kUnconfirmed:
      return Sender{0, trailer->role, Trust::kUnconfirmed};
    case Peers::Freshness::kRepeated:
      ++repeated_;
      break;
  }
  return std::nullopt;
}

void Intake::deliver(const Match& match, const Sender& sender, PacketView message) {
  if (message.size() > match.max_bytes) {
    ++malformed_;
    return;
  }
  const bool is_foreign = key_ && sender.trust != Trust::kAuthentic;
  if (is_foreign && match.access != Access::kAnyone) {
    ++(sender.trust == Trust::kUnconfirmed ? unconfirmed_ : unauthenticated_);
    return;
  }
  std::size_t allowance = match.max_bytes > kMaxFixedSize ? kListQueue : kQueue;
  if (is_foreign) allowance = kAnonymousQueue;
  const bool is_queued =
      queue_.push({match.subscription, sender, {message.begin(), message.end()}}, allowance);
  if (!is_queued) ++crowded_out_;
}

void Intake::trust(std::uint64_t address) {
  const auto found = std::ranges::find(trusted_, address);
  if (found == trusted_.end()) {
    if (trusted_.size() == PacketAssembly::kMaxSenders) trusted_.pop_back();
    trusted_.insert(trusted_.begin(), address);
  } else {
    std::rotate(trusted_.begin(), found, found + 1);
  }
}

bool Intake::is_trusted(std::uint64_t address) const {
  return std::ranges::find(trusted_, address) != trusted_.end();
}

std::optional<Presence> Intake::take_presence(Utime now) {
  return key_ ? peers_.take_due(now) : std::nullopt;
}

Rejections Intake::rejections() const {
  return {malformed_, unauthenticated_, repeated_, unconfirmed_, crowded_out_};
}

}  // namespace dive::link
