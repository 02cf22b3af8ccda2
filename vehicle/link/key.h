#pragma once
// The key that all processes of a dive share, and unpredictable random numbers.

#include <array>
#include <cstdint>
#include <string>

#include <tl/expected.hpp>

#include "common/output_file.h"

namespace dive::link {

using Key = std::array<std::uint8_t, 32>;

[[nodiscard]] Key new_key();
/// A random number from the system's generator for cryptography.
[[nodiscard]] std::uint64_t new_nonce();

/// Reads a regular file of 64 hexadecimal digits that only its owner may read. The error is a
/// sentence.
[[nodiscard]] tl::expected<Key, std::string> read_key(const std::string& path);
/// Creates the key file, which only its owner may read.
[[nodiscard]] tl::expected<void, OutputError> write_key(const std::string& path, const Key& key,
                                                        Existing existing = Existing::kRefuse);

}  // namespace dive::link
