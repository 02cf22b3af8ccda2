#include "vehicle/link/key.h"

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

static_assert(std::tuple_size_v<Key> == crypto_generichash_KEYBYTES);

void start_sodium() { DIVE_DEMAND(sodium_init() >= 0); }

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
  randombytes_buf(key.data(), key.size());
  return key;
}

std::uint64_t new_nonce() {
  start_sodium();
  std::uint64_t nonce = 0;
  randombytes_buf(&nonce, sizeof nonce);
  return nonce;
}

tl::expected<Key, std::string> read_key(const std::string& path) {
  start_sodium();
  // Without O_NONBLOCK, opening a FIFO waits for a writer.
  const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0) {
    return tl::unexpected(fmt::format("cannot read the key '{}': {}", path, reason()));
  }
  if (!S_ISREG(status.st_mode)) {
    return tl::unexpected(
        fmt::format("the key '{}' is not a regular file: make one with dive key", path));
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

}  // namespace dive::link
