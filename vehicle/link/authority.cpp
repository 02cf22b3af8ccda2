#include "vehicle/link/authority.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/assert.h"

namespace dive::link {
namespace {

static_assert(std::tuple_size_v<Seal> == crypto_auth_BYTES);
static_assert(std::tuple_size_v<Key> == crypto_auth_KEYBYTES);

void start_sodium() { DIVE_DEMAND(sodium_init() >= 0); }

// Computed over the whole packet with a zero code; its fingerprint distinguishes requests from
// answers.
template <typename Message>
Seal seal_of(const Key& key, Message message) {
  message.seal = {};
  Packet packet;
  DIVE_DEMAND(encode(message, packet));
  Seal seal;
  crypto_auth(seal.data(), packet.data(), packet.size(), key.data());
  return seal;
}

template <typename Message>
bool has_seal_of(const Key& key, const Message& message) {
  const Seal right = seal_of(key, message);
  return sodium_memcmp(right.data(), message.seal.data(), right.size()) == 0;
}

std::string reason() { return std::generic_category().message(errno); }

class File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  ~File() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace

Key new_key() {
  start_sodium();
  Key key;
  crypto_auth_keygen(key.data());
  return key;
}

std::uint64_t new_boot() {
  start_sodium();
  std::uint64_t boot = 0;
  randombytes_buf(&boot, sizeof boot);
  return boot;
}

tl::expected<Key, std::string> read_key(const std::string& path) {
  start_sodium();
  const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0) {
    return tl::unexpected(fmt::format("cannot read the key '{}': {}", path, reason()));
  }
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return tl::unexpected(
        fmt::format("others may read the key '{0}': run chmod 600 {0}, or make a new one", path));
  }
  std::array<char, 256> text{};
  const ssize_t size = ::read(file.get(), text.data(), text.size());
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

tl::expected<void, std::string> write_key(const std::string& path, const Key& key) {
  const File file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (file.get() < 0) {
    return tl::unexpected(fmt::format("cannot create the key '{}': {}", path, reason()));
  }
  const std::string text = fmt::format("{:02x}\n", fmt::join(key, ""));
  if (::write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    return tl::unexpected(fmt::format("cannot write the key '{}': {}", path, reason()));
  }
  return {};
}

void seal(const Key& key, OperatorRequest& request) { request.seal = seal_of(key, request); }
void seal(const Key& key, OperatorAnswer& answer) { answer.seal = seal_of(key, answer); }
bool is_sealed(const Key& key, const OperatorRequest& request) { return has_seal_of(key, request); }
bool is_sealed(const Key& key, const OperatorAnswer& answer) { return has_seal_of(key, answer); }

const char* describe(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAccepted:
      return "accepted";
    case Verdict::kForged:
      return "refused: it does not bear the seal of the vehicle's key";
    case Verdict::kReplayed:
      return "refused: it, or a later one, has been said before";
    case Verdict::kStale:
      return "refused: it was too long under way";
    case Verdict::kNoKey:
      return "refused: the vehicle has no key, and listens to nothing but abort";
  }
  return "";
}

Gate::Ruling Gate::judge(const OperatorRequest& request, Utime now) {
  Ruling ruling;
  ruling.answer.boot = boot_;
  ruling.answer.counter = request.counter;
  ruling.answer.command = request.command;
  const auto same = [&](const OperatorRequest& other) {
    return other.boot == request.boot && other.counter == request.counter &&
           other.seal == request.seal && other.command == request.command;
  };
  if (last_ && same(*last_)) {  // a repeated request, whose answer was lost
    ruling.answer.verdict = Verdict::kAccepted;
  } else {
    ruling.answer.verdict = check_seal(request, now);
    ruling.act = decide(request, now, ruling.answer.verdict);
    if (ruling.act) last_ = request;
  }
  if (key_) seal(*key_, ruling.answer);
  return ruling;
}

bool Gate::decide(const OperatorRequest& request, Utime now, Verdict& verdict) {
  if (verdict == Verdict::kAccepted) {
    counter_ = request.counter;
    return true;
  }
  // An abort without a code, or with an invalid or stale one, is still an abort. Beyond the rate
  // limit it is only acknowledged.
  if (request.command == OperatorCommand::kAbort) {
    verdict = Verdict::kAccepted;
    const bool acts = may_abort(now);
    if (!acts) ++refused_.too_many;
    return acts;
  }
  if (verdict == Verdict::kReplayed) ++refused_.replayed;
  if (verdict == Verdict::kStale) ++refused_.stale;
  if (verdict == Verdict::kForged || verdict == Verdict::kNoKey) ++refused_.forged;
  return false;
}

Verdict Gate::check_seal(const OperatorRequest& request, Utime now) const {
  if (!key_) return Verdict::kNoKey;
  if (!is_sealed(*key_, request)) return Verdict::kForged;
  if (request.boot != boot_ || request.counter <= counter_) return Verdict::kReplayed;
  const bool is_fresh = request.heard <= now && to_seconds(now - request.heard) <= kMaxAge;
  return is_fresh ? Verdict::kAccepted : Verdict::kStale;
}

bool Gate::may_abort(Utime now) {
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
