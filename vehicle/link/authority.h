#pragma once
// Who may tell the vehicle what to do. Topside and executive share a key; a request bears a seal
// (HMAC-SHA-512/256, libsodium's crypto_auth), the nonce of this start of the executive and a
// counter that only rises, so that none can be forged, kept for later or said twice. To abort takes
// no seal: whoever can reach the vehicle may bring it up, but not so often that it is all it does.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "vehicle/link/codec.h"

namespace dive::link {

using Key = std::array<std::uint8_t, 32>;

[[nodiscard]] Key new_key();
/// A random number that no other start of the executive has had.
[[nodiscard]] std::uint64_t new_boot();

/// A file of 64 hexadecimal digits that only its owner may read. Fails with a sentence.
[[nodiscard]] tl::expected<Key, std::string> read_key(const std::string& path);
/// Creates it, and does not overwrite. Fails with a sentence.
[[nodiscard]] tl::expected<void, std::string> write_key(const std::string& path, const Key& key);

void seal(const Key& key, OperatorRequest& request);
void seal(const Key& key, OperatorAnswer& answer);
[[nodiscard]] bool is_sealed(const Key& key, const OperatorRequest& request);
[[nodiscard]] bool is_sealed(const Key& key, const OperatorAnswer& answer);

[[nodiscard]] const char* describe(Verdict verdict);

/// The executive's side.
class Gate {
 public:
  static constexpr double kMaxAge = 10.0;       ///< s since the heartbeat that was answered to.
  static constexpr double kAbortPeriod = 10.0;  ///< s that one abort without seal takes to earn ...
  static constexpr int kAbortBurst = 3;         ///< ... of which so many may be saved.

  Gate(std::optional<Key> key, std::uint64_t boot) : key_(key), boot_(boot) {}

  struct Ruling {
    OperatorAnswer answer;
    bool act = false;  ///< Accepted, for the first time, and not too often.
  };
  /// `now` is the executive's own time, on which `heard` is as well.
  [[nodiscard]] Ruling judge(const OperatorRequest& request, Utime now);

  [[nodiscard]] std::uint64_t boot() const { return boot_; }
  [[nodiscard]] std::int64_t counter() const { return counter_; }
  [[nodiscard]] bool has_key() const { return key_.has_value(); }
  [[nodiscard]] const Refusals& refused() const { return refused_; }

 private:
  /// Whether to act; where a seal is not needed the verdict changes.
  [[nodiscard]] bool decide(const OperatorRequest& request, Utime now, Verdict& verdict);
  [[nodiscard]] Verdict check_seal(const OperatorRequest& request, Utime now) const;
  [[nodiscard]] bool may_abort(Utime now);

  std::optional<Key> key_;
  std::uint64_t boot_;
  std::int64_t counter_ = 0;
  std::optional<OperatorRequest> last_;  ///< Accepted.
  Refusals refused_;
  double aborts_ = kAbortBurst;
  std::optional<Utime> last_abort_;
};

}  // namespace dive::link
