#include "vehicle/link/peers.h"

#include <algorithm>

namespace dive::link {

bool Peers::is_confirmed(const Peer& peer, Utime now) {
  return peer.confirmed_until && now <= *peer.confirmed_until;
}

Peers::Peer* Peers::find(std::uint64_t sender) {
  const auto found = std::ranges::find(peers_, sender, &Peer::sender);
  return found == peers_.end() ? nullptr : &*found;
}

// A confirmed sender is never forgotten in favour of another.
Peers::Peer* Peers::add(std::uint64_t sender, Utime now) {
  if (peers_.size() == kMaxPeers) {
    const auto rank = [now](const Peer& peer) {
      return std::pair(is_confirmed(peer, now), peer.seen_at);
    };
    const auto dropped = std::ranges::min_element(peers_, {}, rank);
    if (is_confirmed(*dropped, now)) return nullptr;
    *dropped = std::move(peers_.back());
    peers_.pop_back();
  }
  peers_.emplace_back();
  peers_.back().sender = sender;
  return &peers_.back();
}

Peers::Freshness Peers::accept(const Trailer& trailer, std::size_t channel, Utime now) {
  Peer* peer = find(trailer.sender);
  if (peer == nullptr || !is_confirmed(*peer, now) || channel >= kMaxChannels) {
    return Freshness::kUnconfirmed;
  }
  if (channel >= peer->last.size()) peer->last.resize(channel + 1, 0);
  std::uint64_t& last = peer->last[channel];
  if (trailer.counter <= std::max(last, peer->floor)) return Freshness::kRepeated;
  last = trailer.counter;
  return Freshness::kFresh;
}

const Peers::Challenge* Peers::returned_challenge(const Presence& presence, Utime now) const {
  const auto echo = std::ranges::find(presence.echoes, self_, &Presence::Echo::sender);
  if (echo == presence.echoes.end() || !has_sent_) return nullptr;
  const auto found = std::ranges::find_if(challenges_, [&](const Challenge& challenge) {
    return challenge.value == echo->challenge && now - challenge.set_at <= kLifetime;
  });
  return found == challenges_.end() ? nullptr : &*found;
}

void Peers::receive(const Trailer& trailer, const Presence& presence, Utime now) {
  if (trailer.sender == self_) return;
  Peer* peer = find(trailer.sender);
  const bool is_new = peer == nullptr;
  if (is_new) peer = add(trailer.sender, now);
  if (peer == nullptr || trailer.counter <= peer->presence) return;
  // One that appears, or reappears, waits for its challenge to return.
  if (is_new || now - peer->seen_at > 2 * kPeriod) {
    next_due_ = std::min(next_due_, sent_at_ + kMinInterval);
  }
  peer->challenge = presence.challenge;
  peer->presence = trailer.counter;
  peer->seen_at = now;
  const Challenge* challenge = returned_challenge(presence, now);
  if (challenge == nullptr) return;
  peer->confirmed_until =
      std::max(peer->confirmed_until.value_or(0), challenge->set_at + kLifetime);
  peer->floor = trailer.counter;
}

std::optional<Presence> Peers::take_due(Utime now) {
  if (has_sent_ && now < next_due_) return std::nullopt;
  if (!has_sent_ || now - challenges_[newest_].set_at >= kPeriod) {
    newest_ = (newest_ + 1) % challenges_.size();
    challenges_[newest_] = {nonce_(), now};
  }
  has_sent_ = true;
  sent_at_ = now;
  next_due_ = now + kPeriod;
  std::vector<const Peer*> present;
  for (const Peer& peer : peers_) {
    if (now - peer.seen_at <= kLifetime) present.push_back(&peer);
  }
  std::ranges::sort(present, std::ranges::greater(), [now](const Peer* peer) {
    return std::pair(is_confirmed(*peer, now), peer->seen_at);
  });
  present.resize(std::min(present.size(), kMaxEchoes));
  Presence presence;
  presence.challenge = challenges_[newest_].value;
  for (const Peer* peer : present) presence.echoes.push_back({peer->sender, peer->challenge});
  return presence;
}

}  // namespace dive::link
