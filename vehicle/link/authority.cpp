#include "vehicle/link/authority.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/assert.h"
#include "common/input_file.h"

namespace dive::link {
namespace {

static_assert(std::tuple_size_v<Mac> == crypto_auth_BYTES);
static_assert(std::tuple_size_v<Key> == crypto_auth_KEYBYTES);

void start_sodium() { DIVE_DEMAND(sodium_init() >= 0); }

// Computed over the whole packet with a zero code; its fingerprint distinguishes requests from
// answers.
template <typename Message>
Mac mac_of(const Key& key, Message message) {
  message.mac = {};
  Packet packet;
  DIVE_DEMAND(encode(message, packet));
  Mac mac;
  crypto_auth(mac.data(), packet.data(), packet.size(), key.data());
  return mac;
}

template <typename Message>
bool has_mac_of(const Key& key, const Message& message) {
  const Mac right = mac_of(key, message);
  return sodium_memcmp(right.data(), message.mac.data(), right.size()) == 0;
}

std::string reason() { return std::generic_category().message(errno); }

}  // namespace

Key new_key() {
  start_sodium();
  Key key;
  crypto_auth_keygen(key.data());
  return key;
}

std::uint64_t new_session_id() {
  start_sodium();
  std::uint64_t session_id = 0;
  randombytes_buf(&session_id, sizeof session_id);
  return session_id;
}

tl::expected<Key, std::string> read_key(const std::string& path) {
  start_sodium();
  const tl::expected<Descriptor, std::string> file = open_input(path);
  if (!file) return tl::unexpected(fmt::format("cannot read the key '{}': {}", path, file.error()));
  struct stat status {};
  if (::fstat(file->get(), &status) != 0) {
    return tl::unexpected(fmt::format("cannot read the key '{}': {}", path, reason()));
  }
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return tl::unexpected(
        fmt::format("others may read the key '{0}': run chmod 600 {0}, or make a new one", path));
  }
  std::array<char, 256> text{};
  const ssize_t size = ::read(file->get(), text.data(), text.size());
  Key key;
  std::size_t length = 0;
  const bool is_hex =
      size > 0 && sodium_hex2bin(key.data(), key.size(), text.data(),
                                 static_cast<std::size_t>(size), " \n\r", &length, nullptr) == 0;
  if (!is_hex || length != key.size()) {
    return tl::unexpected(
        fmt::format("'{}' is not a key: that is {} hexadecimal digits", path, 2 * key.size()));
  }
  return key;
}

tl::expected<void, OutputError> write_key(const std::string& path, const Key& key,
                                          Existing existing) {
  tl::expected<OutputFile, OutputError> file = OutputFile::create(path, existing, 0600);
  if (!file) return tl::unexpected(std::move(file.error()));
  // One that is replaced may be readable for others.
  struct stat status {};
  const bool is_old = existing == Existing::kReplace && ::stat(path.c_str(), &status) == 0 &&
                      S_ISREG(status.st_mode);
  if (is_old && ::chmod(path.c_str(), 0600) != 0) {
    return tl::make_unexpected(
        OutputError{OutputError::Kind::kName, fmt::format("{}: {}", path, reason())});
  }
  tl::expected<void, OutputError> written =
      file->write(fmt::format("{:02x}\n", fmt::join(key, "")));
  return written ? file->close() : written;
}

void sign(const Key& key, OperatorRequest& request) { request.mac = mac_of(key, request); }
void sign(const Key& key, OperatorAnswer& answer) { answer.mac = mac_of(key, answer); }
bool has_valid_mac(const Key& key, const OperatorRequest& request) {
  return has_mac_of(key, request);
}
bool has_valid_mac(const Key& key, const OperatorAnswer& answer) { return has_mac_of(key, answer); }

const char* describe(RequestResult result) {
  switch (result) {
    case RequestResult::kAccepted:
      return "accepted";
    case RequestResult::kAuthFailed:
      return "refused: it does not bear the seal of the vehicle's key";
    case RequestResult::kReplayed:
      return "refused: it, or a later one, has been said before";
    case RequestResult::kStale:
      return "refused: it was too long under way";
    case RequestResult::kNoKey:
      return "refused: the vehicle has no key, and listens to nothing but abort";
  }
  return "";
}

RequestAuthenticator::Decision RequestAuthenticator::evaluate(const OperatorRequest& request,
                                                              Utime now) {
  Decision decision;
  decision.answer.session_id = session_id_;
  decision.answer.counter = request.counter;
  decision.answer.command = request.command;
  const auto same = [&](const OperatorRequest& other) {
    return other.session_id == request.session_id && other.counter == request.counter &&
           other.mac == request.mac && other.command == request.command;
  };
  if (last_ && same(*last_)) {  // a repeated request, whose answer was lost
    decision.answer.result = RequestResult::kAccepted;
  } else {
    decision.answer.result = check_mac(request, now);
    decision.act = decide(request, now, decision.answer.result);
    if (decision.act) last_ = request;
  }
  if (key_) sign(*key_, decision.answer);
  return decision;
}

bool RequestAuthenticator::decide(const OperatorRequest& request, Utime now,
                                  RequestResult& result) {
  if (result == RequestResult::kAccepted) {
    counter_ = request.counter;
    return true;
  }
  // An abort without a code, or with an invalid or stale one, is still an abort. Beyond the rate
  // limit it is only acknowledged.
  if (request.command == OperatorCommand::kAbort) {
    result = RequestResult::kAccepted;
    const bool acts = may_abort(now);
    if (!acts) ++refused_.rate_limited;
    return acts;
  }
  if (result == RequestResult::kReplayed) ++refused_.replayed;
  if (result == RequestResult::kStale) ++refused_.stale;
  if (result == RequestResult::kAuthFailed || result == RequestResult::kNoKey)
    ++refused_.auth_failed;
  return false;
}

RequestResult RequestAuthenticator::check_mac(const OperatorRequest& request, Utime now) const {
  if (!key_) return RequestResult::kNoKey;
  if (!has_valid_mac(*key_, request)) return RequestResult::kAuthFailed;
  if (request.session_id != session_id_ || request.counter <= counter_)
    return RequestResult::kReplayed;
  const bool is_fresh =
      request.heartbeat_utime <= now && to_seconds(now - request.heartbeat_utime) <= kMaxAge;
  return is_fresh ? RequestResult::kAccepted : RequestResult::kStale;
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
