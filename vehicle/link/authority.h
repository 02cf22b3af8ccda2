#pragma once
// The executive's decisions on operator requests. Who sent a request is decided before
// (vehicle/link/envelope.h); this decides what may be done by it. A request carries the executive's
// session, a counter that only increases, and the challenge of a heartbeat, a random number that
// changes every two seconds: none can be prepared, kept or repeated. An abort needs neither key nor
// challenge, unless the mission says so: any operator within reach may surface the vehicle, but at
// a limited rate, so that aborts cannot occupy it.

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "common/clock.h"
#include "vehicle/link/arrival_queue.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/key.h"

namespace dive::link {

[[nodiscard]] const char* describe(RequestResult result);

struct RequestPolicy {
  bool has_key = false;  ///< False: no request but an abort is accepted.
  bool abort_needs_key = false;
};

class RequestAuthenticator {
 public:
  static constexpr double kChallengePeriod = 2.0;  ///< s; a challenge is valid for two periods.
  static constexpr double kAbortPeriod = 10.0;     ///< Time per permitted anonymous abort, s.
  static constexpr int kAbortBurst = 3;            ///< Maximum number of such aborts in a burst.

  explicit RequestAuthenticator(RequestPolicy policy,
                                std::function<std::uint64_t()> nonce = new_nonce)
      : policy_(policy), nonce_(std::move(nonce)), session_id_(nonce_()) {}

  struct Decision {
    std::optional<OperatorAnswer> answer;
    bool act = false;  ///< True if accepted, for the first time, and within the rate limit.
  };
  /// `now` is of one monotonic clock. A request of Trust::kUnconfirmed, which may be a recording or
  /// of a sender that has just started, is not answered: its sender repeats it.
  [[nodiscard]] Decision evaluate(const OperatorRequest& request, Trust trust, Utime now);

  /// For the heartbeat.
  [[nodiscard]] std::uint64_t challenge(Utime now);

  [[nodiscard]] std::uint64_t session_id() const { return session_id_; }
  [[nodiscard]] std::int64_t counter() const { return counter_; }
  [[nodiscard]] bool has_key() const { return policy_.has_key; }
  [[nodiscard]] const Refusals& refused() const { return refused_; }

 private:
  [[nodiscard]] RequestResult check(const OperatorRequest& request, Trust trust, Utime now);
  [[nodiscard]] bool decide_abort(Trust trust, Utime now, RequestResult& result);
  [[nodiscard]] bool may_abort(Utime now);
  void count(RequestResult result);

  RequestPolicy policy_;
  std::function<std::uint64_t()> nonce_;
  std::uint64_t session_id_;
  std::int64_t counter_ = 0;
  std::optional<OperatorRequest> last_;  ///< Last accepted request.
  std::optional<std::uint64_t> challenge_;
  std::optional<std::uint64_t> last_challenge_;
  Utime challenge_set_at_ = 0;
  Refusals refused_;
  double aborts_ = kAbortBurst;
  std::optional<Utime> last_abort_;
};

}  // namespace dive::link
