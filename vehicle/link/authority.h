#pragma once
// Authentication of operator requests. Topside and executive share a key; a request carries a
// message authentication code (HMAC-SHA-512/256, libsodium's crypto_auth), the nonce of the
// executive's session and a counter that only increases, so that a request cannot be forged,
// delayed or repeated. An abort needs no code: any operator within reach may surface the vehicle,
// but at a limited rate, so that aborts cannot occupy it.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "common/output_file.h"
#include "vehicle/link/codec.h"

namespace dive::link {

using Key = std::array<std::uint8_t, 32>;

[[nodiscard]] Key new_key();
/// A random number that is unique to this start of the executive.
[[nodiscard]] std::uint64_t new_session_id();

/// Reads a file of 64 hexadecimal digits that only its owner may read. The error is a sentence.
[[nodiscard]] tl::expected<Key, std::string> read_key(const std::string& path);
/// Creates the key file, which only its owner may read.
[[nodiscard]] tl::expected<void, OutputError> write_key(const std::string& path, const Key& key,
                                                        Existing existing = Existing::kRefuse);

void sign(const Key& key, OperatorRequest& request);
void sign(const Key& key, OperatorAnswer& answer);
[[nodiscard]] bool has_valid_mac(const Key& key, const OperatorRequest& request);
[[nodiscard]] bool has_valid_mac(const Key& key, const OperatorAnswer& answer);

[[nodiscard]] const char* describe(RequestResult result);

/// The executive's authentication of requests.
class RequestAuthenticator {
 public:
  static constexpr double kMaxAge = 10.0;       ///< Maximum age of the acknowledged heartbeat, s.
  static constexpr double kAbortPeriod = 10.0;  ///< Time per permitted abort without a code, s.
  static constexpr int kAbortBurst = 3;         ///< Maximum number of such aborts in a burst.

  RequestAuthenticator(std::optional<Key> key, std::uint64_t session_id)
      : key_(key), session_id_(session_id) {}

  struct Decision {
    OperatorAnswer answer;
    bool act = false;  ///< True if accepted, for the first time, and within the rate limit.
  };
  /// `now` and `heartbeat_utime` are both on the executive's clock.
  [[nodiscard]] Decision evaluate(const OperatorRequest& request, Utime now);

  [[nodiscard]] std::uint64_t session_id() const { return session_id_; }
  [[nodiscard]] std::int64_t counter() const { return counter_; }
  [[nodiscard]] bool has_key() const { return key_.has_value(); }
  [[nodiscard]] const Refusals& refused() const { return refused_; }

 private:
  /// True if the executive is to act; changes the result where no code is needed.
  [[nodiscard]] bool decide(const OperatorRequest& request, Utime now, RequestResult& result);
  [[nodiscard]] RequestResult check_mac(const OperatorRequest& request, Utime now) const;
  [[nodiscard]] bool may_abort(Utime now);

  std::optional<Key> key_;
  std::uint64_t session_id_;
  std::int64_t counter_ = 0;
  std::optional<OperatorRequest> last_;  ///< Last accepted request.
  Refusals refused_;
  double aborts_ = kAbortBurst;
  std::optional<Utime> last_abort_;
};

}  // namespace dive::link
