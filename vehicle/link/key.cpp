#include "vehicle/link/key.h"

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

static_assert(std::tuple_size_v<Key> == crypto_generichash_KEYBYTES);

void start_sodium() { DIVE_DEMAND(sodium_init() >= 0); }

std::string reason() { return std::generic_category().message(errno); }

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
        fmt::format("'{}' is not a key file: it must contain {} hexadecimal digits; make one with "
                    "dive key FILE",
                    path, 2 * key.size()));
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
  const tl::expected<void, OutputError> written =
      file->write(fmt::format("{:02x}\n", fmt::join(key, "")));
  return written ? file->close() : written;
}

}  // namespace dive::link
