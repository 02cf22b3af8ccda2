#pragma once
// The compressions of chunks in bags.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "estimation/dataset/bag/byte_reader.h"

namespace dive::estimation {

/// Limit of a chunk's size; writers make chunks of some megabytes, one image at least.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{256} << 20U;

/// True if the bytes begin as a frame of zstd.
[[nodiscard]] bool is_zstd(Bytes bytes);

/// Decompresses a chunk. `compression`: "bz2", "lz4" or "zstd" (frames), or "none" or "" for a
/// copy. The result must have exactly `size` bytes. The error is a clause with the reason.
[[nodiscard]] tl::expected<std::vector<std::uint8_t>, std::string> decompress(
    std::string_view compression, Bytes stored, std::uint64_t size);

}  // namespace dive::estimation
