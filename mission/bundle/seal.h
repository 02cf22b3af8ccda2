#pragma once
// The end of a bundle, which covers every byte before it. The data of the record DIVE_BUNDLE_SEAL:
//   1 byte    1: with a code, 0: without
//   32 bytes  code: keyed BLAKE2b-256, under a key that is derived from the dive's, of all bytes
//             before this record; zeros without a key
//   32 bytes  hash: BLAKE2b-256 of all bytes before it, code included
// Anyone can compute the hash: alone it shows damage and careless changes. The code shows that a
// process with the key made the bundle.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "vehicle/link/key.h"

namespace dive::mission {

inline constexpr std::string_view kSealChannel = "DIVE_BUNDLE_SEAL";

/// Appends the record with number `number`, which completes the bundle.
void append_seal(std::int64_t number, const std::optional<link::Key>& key,
                 std::vector<std::uint8_t>& records);

struct Seal {
  std::array<std::uint8_t, 32> hash;
  bool has_code = false;
  bool is_authentic = false;  ///< False without a key.
  std::size_t size = 0;       ///< Bytes of the record.
};

/// The seal at the end of `bytes`, if the hash is right, and with a key the code too. The error is
/// a sentence.
[[nodiscard]] tl::expected<Seal, std::string> check_seal(std::span<const std::uint8_t> bytes,
                                                         const std::optional<link::Key>& key);

}  // namespace dive::mission
