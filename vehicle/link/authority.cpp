#include "vehicle/link/authority.h"

#include <algorithm>

namespace dive::link {
namespace {

// A repetition carries the newest challenge.
bool is_repetition(const OperatorRequest& a, const OperatorRequest& b) {
  return a.session_id == b.session_id && a.counter == b.counter && a.command == b.command;
}

}  // namespace

const char* describe(RequestResult result) {
  switch (result) {
    case RequestResult::kAccepted:
      return "accepted";
    case RequestResult::kAuthFailed:
      return "refused: it was not authenticated with the vehicle's key";
    case RequestResult::kReplayed:
      return "refused: it was a repetition, or older than one that was accepted";
    case RequestResult::kStale:
      return "refused: it arrived too late; send it again";
    case RequestResult::kNoKey:
      return "refused: the vehicle has no key and accepts nothing but abort";
  }
  return "";
}

RequestAuthenticator::Decision RequestAuthenticator::evaluate(const OperatorRequest& request,
                                                              Trust trust, Utime now) {
  const bool is_abort = request.command == OperatorCommand::kAbort;
  Decision decision;
  if (trust == Trust::kUnconfirmed && (!is_abort || policy_.abort_needs_key)) return decision;
  RequestResult result = RequestResult::kAccepted;
  // A repeated request, whose answer was lost, is only answered again.
  if (trust != Trust::kAuthentic || !last_ || !is_repetition(*last_, request)) {
    result = check(request, trust, now);
    decision.act = result == RequestResult::kAccepted;
    if (decision.act) {
      counter_ = request.counter;
      last_ = request;
    } else if (is_abort) {
      decision.act = decide_abort(trust, now, result);
    }
    if (result != RequestResult::kAccepted) count(result);
  }
  decision.answer = OperatorAnswer{session_id_, request.counter, request.command, result};
  return decision;
}

RequestResult RequestAuthenticator::check(const OperatorRequest& request, Trust trust, Utime now) {
  if (!policy_.has_key) return RequestResult::kNoKey;
  if (trust != Trust::kAuthentic) return RequestResult::kAuthFailed;
  if (request.session_id != session_id_ || request.counter <= counter_)
    return RequestResult::kReplayed;
  const bool is_fresh = request.challenge == challenge(now) || request.challenge == last_challenge_;
  return is_fresh ? RequestResult::kAccepted : RequestResult::kStale;
}

// An abort with the key is accepted whatever its challenge, because it is sent before the first
// heartbeat arrives. Anyone's is accepted unless the mission says otherwise; beyond the rate limit
// it is only acknowledged.
bool RequestAuthenticator::decide_abort(Trust trust, Utime now, RequestResult& result) {
  if (trust == Trust::kAuthentic) {
    result = RequestResult::kAccepted;
    return true;
  }
  if (policy_.abort_needs_key) return false;
  result = RequestResult::kAccepted;
  const bool acts = may_abort(now);
  if (!acts) ++refused_.rate_limited;
  return acts;
}

void RequestAuthenticator::count(RequestResult result) {
  if (result == RequestResult::kReplayed) {
    ++refused_.replayed;
  } else if (result == RequestResult::kStale) {
    ++refused_.stale;
  } else {
    ++refused_.auth_failed;
  }
}

std::uint64_t RequestAuthenticator::challenge(Utime now) {
  if (!challenge_ || to_seconds(now - challenge_set_at_) >= kChallengePeriod) {
    const bool is_next = challenge_ && to_seconds(now - challenge_set_at_) < 2 * kChallengePeriod;
    last_challenge_ = is_next ? challenge_ : std::nullopt;
    challenge_ = nonce_();
    challenge_set_at_ = now;
  }
  return *challenge_;
}

bool RequestAuthenticator::may_abort(Utime now) {
  if (last_abort_) {
    aborts_ =
        std::min<double>(aborts_ + to_seconds(now - *last_abort_) / kAbortPeriod, kAbortBurst);
  }
  last_abort_ = now;
  if (aborts_ < 1.0) return false;
  aborts_ -= 1.0;
  return true;
}

}  // namespace dive::link
