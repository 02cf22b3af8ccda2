#include "estimation/dataset/bag/decompress.h"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

namespace dive::estimation {
namespace {

using Buffer = std::vector<std::uint8_t>;

// Each returns the number of bytes written to `to`, or the reason for an error.
using Length = tl::expected<std::uint64_t, std::string>;

Length unpack_bz2(Bytes stored, Buffer& to) {
  auto length = static_cast<unsigned>(to.size());
  // The library does not write to its input.
  auto* const from = reinterpret_cast<char*>(const_cast<std::uint8_t*>(stored.data()));
  const int status = BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(to.data()), &length, from,
                                                static_cast<unsigned>(stored.size()), 0, 0);
  if (status == BZ_OUTBUFF_FULL) return std::numeric_limits<std::uint64_t>::max();
  if (status != BZ_OK) return tl::make_unexpected(fmt::format("damaged bz2 data ({})", status));
  return length;
}

Length unpack_lz4(Bytes stored, Buffer& to) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0U) {
    return tl::make_unexpected(std::string("no memory for lz4"));
  }
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, &LZ4F_freeDecompressionContext);
  std::size_t written = 0;
  std::size_t read = 0;
  for (;;) {
    std::size_t room = to.size() - written;
    std::size_t rest = stored.size() - read;
    const std::size_t hint = LZ4F_decompress(context.get(), to.data() + written, &room,
                                             stored.data() + read, &rest, nullptr);
    if (LZ4F_isError(hint) != 0U) {
      return tl::make_unexpected(fmt::format("damaged lz4 data ({})", LZ4F_getErrorName(hint)));
    }
    written += room;
    read += rest;
    if (hint == 0) return written;
    if (room == 0 && rest == 0) return tl::make_unexpected(std::string("incomplete lz4 data"));
  }
}

Length unpack_zstd(Bytes stored, Buffer& to) {
  const std::size_t length = ZSTD_decompress(to.data(), to.size(), stored.data(), stored.size());
  if (ZSTD_isError(length) != 0U) {
    return tl::make_unexpected(fmt::format("damaged zstd data ({})", ZSTD_getErrorName(length)));
  }
  return length;
}

}  // namespace

bool is_zstd(Bytes bytes) {
  constexpr std::array<std::uint8_t, 4> kMagic{0x28, 0xB5, 0x2F, 0xFD};
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

tl::expected<Buffer, std::string> decompress(std::string_view compression, Bytes stored,
                                             std::uint64_t size) {
  if (size > kMaxChunkBytes || stored.size() > kMaxChunkBytes) {
    return tl::make_unexpected(fmt::format("a chunk of {} bytes; at most {} are read",
                                           std::max<std::uint64_t>(size, stored.size()),
                                           kMaxChunkBytes));
  }
  if (compression.empty() || compression == "none") {
    if (stored.size() == size) return Buffer(stored.begin(), stored.end());
    return tl::make_unexpected(
        fmt::format("a chunk of {} bytes states a size of {}", stored.size(), size));
  }
  Buffer buffer(static_cast<std::size_t>(size));
  const Length length =
      compression == "bz2"   ? unpack_bz2(stored, buffer)
      : compression == "lz4" ? unpack_lz4(stored, buffer)
      : compression == "zstd"
          ? unpack_zstd(stored, buffer)
          : tl::make_unexpected(fmt::format("compression \"{}\" is not known", compression));
  if (!length) return tl::make_unexpected(length.error());
  if (*length != size) {
    return tl::make_unexpected(fmt::format("a chunk does not have the {} bytes it states", size));
  }
  return buffer;
}

}  // namespace dive::estimation
