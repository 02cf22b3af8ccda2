#include "mission/export/mcap_writer.h"

#include <algorithm>

#include <zlib.h>

#include "common/assert.h"
#include "mission/export/little_endian.h"

namespace dive::mission {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunkBytes = 1U << 20U;

// Opcodes.
constexpr std::uint8_t kHeader = 0x01;
constexpr std::uint8_t kFooter = 0x02;
constexpr std::uint8_t kSchema = 0x03;
constexpr std::uint8_t kChannel = 0x04;
constexpr std::uint8_t kMessage = 0x05;
constexpr std::uint8_t kChunk = 0x06;
constexpr std::uint8_t kMessageIndex = 0x07;
constexpr std::uint8_t kChunkIndex = 0x08;
constexpr std::uint8_t kStatistics = 0x0B;
constexpr std::uint8_t kSummaryOffset = 0x0E;
constexpr std::uint8_t kDataEnd = 0x0F;

void put_text(std::string& to, std::string_view text) {
  put(to, static_cast<std::uint32_t>(text.size()));
  to.append(text);
}

void put_map(std::string& to, const std::map<std::uint16_t, std::uint64_t>& map) {
  put(to, static_cast<std::uint32_t>(map.size() * (sizeof(std::uint16_t) + sizeof(std::uint64_t))));
  for (const auto& [key, value] : map) {
    put(to, key);
    put(to, value);
  }
}

void put_record(std::string& to, std::uint8_t opcode, std::string_view content) {
  put(to, opcode);
  put(to, static_cast<std::uint64_t>(content.size()));
  to.append(content);
}

std::uint32_t crc_of(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

}  // namespace

McapWriter::McapWriter(std::string_view library) {
  file_ = kMagic;
  std::string header;
  put_text(header, "");  // no profile
  put_text(header, library);
  put_record(file_, kHeader, header);
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view json_schema) {
  DIVE_DEMAND(counts_.empty());  // schemas come first
  std::string schema;
  put(schema, ++schemas_);  // 0 means no schema
  put_text(schema, name);
  put_text(schema, "jsonschema");
  put_text(schema, json_schema);
  put_record(definitions_, kSchema, schema);
  schema_bytes_ = definitions_.size();
  return schemas_;
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::uint16_t schema) {
  DIVE_DEMAND(messages_ == 0);
  const auto id = static_cast<std::uint16_t>(counts_.size());
  counts_[id] = 0;
  std::string channel;
  put(channel, id);
  put(channel, schema);
  put_text(channel, topic);
  put_text(channel, "json");
  put(channel, std::uint32_t{0});  // no metadata
  put_record(definitions_, kChannel, channel);
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time_ns, std::string_view json) {
  if (messages_ == 0) {
    file_ += definitions_;
    first_ns_ = last_ns_ = time_ns;
  }
  if (open_.empty()) chunk_.first_ns = chunk_.last_ns = time_ns;
  for (auto* range : {&first_ns_, &chunk_.first_ns}) *range = std::min(*range, time_ns);
  for (auto* range : {&last_ns_, &chunk_.last_ns}) *range = std::max(*range, time_ns);
  index_[channel].push_back({time_ns, open_.size()});
  ++messages_;
  const auto sequence = static_cast<std::uint32_t>(++counts_.at(channel));
  put(open_, kMessage);
  constexpr std::size_t kFixed = 2 + 4 + 8 + 8;
  put(open_, static_cast<std::uint64_t>(kFixed + json.size()));
  put(open_, channel);
  put(open_, sequence);
  put(open_, time_ns);  // of the log
  put(open_, time_ns);  // of its publication
  open_.append(json);
  if (open_.size() >= kChunkBytes) end_chunk();
}

void McapWriter::end_chunk() {
  if (open_.empty()) return;
  chunk_.start = file_.size();
  chunk_.size = open_.size();
  std::string content;
  put(content, chunk_.first_ns);
  put(content, chunk_.last_ns);
  put(content, static_cast<std::uint64_t>(open_.size()));
  put(content, crc_of(open_));
  put_text(content, "");  // not compressed
  put(content, static_cast<std::uint64_t>(open_.size()));
  content += open_;
  put_record(file_, kChunk, content);
  chunk_.length = file_.size() - chunk_.start;
  const std::size_t indices = file_.size();
  for (const auto& [channel, entries] : index_) {
    chunk_.index_offsets[channel] = file_.size();
    std::string index;
    put(index, channel);
    put(index, static_cast<std::uint32_t>(entries.size() * sizeof(IndexEntry)));
    for (const IndexEntry& entry : entries) {
      put(index, entry.time_ns);
      put(index, entry.offset);
    }
    put_record(file_, kMessageIndex, index);
  }
  chunk_.index_length = file_.size() - indices;
  chunks_.push_back(std::move(chunk_));
  chunk_ = {};
  index_.clear();
  open_.clear();
}

std::string McapWriter::chunk_index(const Chunk& chunk) {
  std::string content;
  put(content, chunk.first_ns);
  put(content, chunk.last_ns);
  put(content, chunk.start);
  put(content, chunk.length);
  put_map(content, chunk.index_offsets);
  put(content, chunk.index_length);
  put_text(content, "");
  put(content, chunk.size);  // compressed
  put(content, chunk.size);
  return content;
}

std::string McapWriter::statistics() const {
  std::string content;
  put(content, messages_);
  put(content, schemas_);
  put(content, static_cast<std::uint32_t>(counts_.size()));
  put(content, std::uint32_t{0});  // attachments
  put(content, std::uint32_t{0});  // metadata
  put(content, static_cast<std::uint32_t>(chunks_.size()));
  put(content, first_ns_);
  put(content, last_ns_);
  put_map(content, counts_);
  return content;
}

// Groups of records, and where each group is.
void McapWriter::write_summary() {
  const std::uint64_t start = file_.size();
  std::string offsets;
  const auto group = [&](std::uint8_t opcode, std::string_view records) {
    if (records.empty()) return;
    std::string offset;
    put(offset, opcode);
    put(offset, static_cast<std::uint64_t>(file_.size()));
    put(offset, static_cast<std::uint64_t>(records.size()));
    put_record(offsets, kSummaryOffset, offset);
    file_.append(records);
  };
  const std::string_view definitions = definitions_;
  group(kSchema, definitions.substr(0, schema_bytes_));
  group(kChannel, definitions.substr(schema_bytes_));
  std::string records;
  put_record(records, kStatistics, statistics());
  group(kStatistics, records);
  records.clear();
  for (const Chunk& chunk : chunks_) put_record(records, kChunkIndex, chunk_index(chunk));
  group(kChunkIndex, records);
  const std::uint64_t offset_start = file_.size();
  file_ += offsets;
  std::string footer;
  put(footer, start);
  put(footer, offset_start);
  put(footer, std::uint32_t{0});  // no checksum of the summary
  put_record(file_, kFooter, footer);
}

std::string McapWriter::finish() {
  if (messages_ == 0) file_ += definitions_;
  end_chunk();
  std::string end;
  put(end, std::uint32_t{0});  // no checksum: each chunk has its own
  put_record(file_, kDataEnd, end);
  write_summary();
  file_ += kMagic;
  return std::move(file_);
}

}  // namespace dive::mission
