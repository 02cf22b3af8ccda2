#pragma once
// Writes MCAP files (https://mcap.dev/spec): uncompressed chunks with an index and a summary, so
// that readers can seek. Private to mission/export; doc/decisions/own-mcap-writer.md.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace dive::mission {

class McapWriter {
 public:
  explicit McapWriter(std::string_view library);

  /// A schema in the language JSON Schema; returns its id. All schemas and channels come before the
  /// first message.
  [[nodiscard]] std::uint16_t add_schema(std::string_view name, std::string_view json_schema);
  /// A channel of JSON messages; returns its id.
  [[nodiscard]] std::uint16_t add_channel(std::string_view topic, std::uint16_t schema);
  /// `time_ns`: since the epoch of the vehicle's clock, >= 0.
  void write(std::uint16_t channel, std::uint64_t time_ns, std::string_view json);
  /// The whole file. Nothing can be written afterwards.
  [[nodiscard]] std::string finish();

 private:
  struct Chunk {
    std::uint64_t first_ns = 0;
    std::uint64_t last_ns = 0;
    std::uint64_t start = 0;   ///< File offset of its record.
    std::uint64_t length = 0;  ///< Of its record.
    std::map<std::uint16_t, std::uint64_t> index_offsets;
    std::uint64_t index_length = 0;
    std::uint64_t size = 0;
  };
  /// Where the messages of a channel are in the chunk.
  struct IndexEntry {
    std::uint64_t time_ns = 0;
    std::uint64_t offset = 0;
  };

  void end_chunk();
  void write_summary();
  [[nodiscard]] std::string statistics() const;
  [[nodiscard]] static std::string chunk_index(const Chunk& chunk);

  std::string file_;
  std::string definitions_;  ///< Records of schemas and channels, repeated in the summary.
  std::size_t schema_bytes_ = 0;
  std::uint16_t schemas_ = 0;
  std::map<std::uint16_t, std::uint64_t> counts_;  ///< Messages of each channel.
  std::uint64_t first_ns_ = 0;
  std::uint64_t last_ns_ = 0;
  std::uint64_t messages_ = 0;
  std::string open_;  ///< Records of the chunk that is not written yet.
  Chunk chunk_;
  std::map<std::uint16_t, std::vector<IndexEntry>> index_;
  std::vector<Chunk> chunks_;
};

}  // namespace dive::mission
