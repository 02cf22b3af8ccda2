#include "mission/bundle/seal.h"

#include <algorithm>
#include <string>

#include <sodium.h>

#include "common/assert.h"
#include "mission/record/log_frame.h"

namespace dive::mission {
namespace {

constexpr std::size_t kHashSize = 32;
constexpr std::size_t kFlagSize = 1;
constexpr std::size_t kDataSize = kFlagSize + kHashSize + kHashSize;
constexpr std::size_t kBeforeData = kFrameSize + kSealChannel.size();
constexpr std::size_t kSealSize = kBeforeData + kDataSize + kChecksumSize;

using Bytes = std::span<const std::uint8_t>;
using Hash = std::array<std::uint8_t, kHashSize>;

Hash hash_of(Bytes bytes) {
  Hash hash;
  crypto_generichash(hash.data(), hash.size(), bytes.data(), bytes.size(), nullptr, 0);
  return hash;
}

// A key of its own, so that no packet of the link can be taken for a bundle, nor the reverse.
Hash code_of(const link::Key& key, Bytes bytes) {
  constexpr std::string_view kPurpose = "dive bundle 1";
  Hash bundle_key;
  crypto_generichash(bundle_key.data(), bundle_key.size(),
                     reinterpret_cast<const std::uint8_t*>(kPurpose.data()), kPurpose.size(),
                     key.data(), key.size());
  Hash code;
  crypto_generichash(code.data(), code.size(), bytes.data(), bytes.size(), bundle_key.data(),
                     bundle_key.size());
  return code;
}

// Frame, channel, flag and code of the seal: what the hash covers besides the content.
std::vector<std::uint8_t> begin_seal(std::int64_t number, bool has_code, const Hash& code) {
  const FrameBytes frame = to_bytes({number, 0, kSealChannel.size(), kDataSize + kChecksumSize});
  std::vector<std::uint8_t> bytes(frame.begin(), frame.end());
  bytes.insert(bytes.end(), kSealChannel.begin(), kSealChannel.end());
  bytes.push_back(has_code ? 1 : 0);
  bytes.insert(bytes.end(), code.begin(), code.end());
  return bytes;
}

bool has_right_checksum(Bytes seal) {
  FrameBytes frame;
  std::ranges::copy(seal.first(kFrameSize), frame.begin());
  const auto checksum =
      checksum_bytes(record_checksum(frame, kSealChannel, seal.subspan(kBeforeData, kDataSize)));
  return std::ranges::equal(checksum, seal.last(kChecksumSize));
}

tl::unexpected<std::string> refuse(const char* why) { return tl::unexpected(std::string(why)); }

}  // namespace

void append_seal(std::int64_t number, const std::optional<link::Key>& key,
                 std::vector<std::uint8_t>& records) {
  DIVE_DEMAND(sodium_init() >= 0);
  const Hash code = key ? code_of(*key, records) : Hash{};
  std::vector<std::uint8_t> covered = records;
  const std::vector<std::uint8_t> begun = begin_seal(number, key.has_value(), code);
  covered.insert(covered.end(), begun.begin(), begun.end());
  const Hash hash = hash_of(covered);
  std::vector<std::uint8_t> data(begun.begin() + kBeforeData, begun.end());
  data.insert(data.end(), hash.begin(), hash.end());
  append_record({number, 0, 0, 0}, kSealChannel, data, records);
}

tl::expected<Seal, std::string> check_seal(Bytes bytes, const std::optional<link::Key>& key) {
  DIVE_DEMAND(sodium_init() >= 0);
  if (bytes.size() < kSealSize) return refuse("it is cut off");
  const Bytes covered = bytes.first(bytes.size() - kChecksumSize - kHashSize);
  const Bytes hash = bytes.subspan(covered.size(), kHashSize);
  const Bytes record = bytes.last(kSealSize);
  Seal seal{hash_of(covered), false, false, kSealSize};
  if (!std::ranges::equal(seal.hash, hash) || !has_right_checksum(record) ||
      !std::ranges::equal(record.subspan(kFrameSize, kSealChannel.size()), kSealChannel)) {
    return refuse("it was changed or damaged after the check: its hash is wrong");
  }
  const Bytes flag_and_code = record.subspan(kBeforeData, kFlagSize + kHashSize);
  seal.has_code = flag_and_code[0] == 1;
  if (!key) return seal;
  if (!seal.has_code) {
    return refuse("it has no code, and --key requires one");
  }
  const Hash code = code_of(*key, bytes.first(bytes.size() - kSealSize));
  if (sodium_memcmp(code.data(), flag_and_code.data() + kFlagSize, code.size()) != 0) {
    return refuse("its code was made with another key, or the bundle was changed without the key");
  }
  seal.is_authentic = true;
  return seal;
}

}  // namespace dive::mission
