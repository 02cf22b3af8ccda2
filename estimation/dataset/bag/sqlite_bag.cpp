// Bags of ROS 2 in sqlite3, as rosbag2 writes them: a table of topics (id, name, type,
// serialization_format) and one of messages (id, topic_id, timestamp, data).

#include <map>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

#include "estimation/dataset/bag/bag_file.h"
#include "estimation/dataset/bag/decompress.h"

namespace dive::estimation {
namespace {

using Failure = tl::unexpected<std::string>;

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
};
using Statement = std::unique_ptr<sqlite3_stmt, Close>;
using Blob = std::unique_ptr<sqlite3_blob, Close>;

class Database {
 public:
  // The file that was opened, by its descriptor: no other can take its place, and no name has to be
  // quoted. Nothing beside it (a journal) is read.
  [[nodiscard]] static tl::expected<std::shared_ptr<Database>, std::string> open(
      const std::string& path) {
    auto file = open_input(path);
    if (!file) return Failure(file.error());
    auto database = std::make_shared<Database>();
    database->file_ = std::move(*file);
    const std::string name =
        fmt::format("file:/proc/self/fd/{}?immutable=1", database->file_.get());
    sqlite3* raw = nullptr;
    const int status =
        sqlite3_open_v2(name.c_str(), &raw, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    database->sqlite_.reset(raw);
    if (status != SQLITE_OK) return Failure("the database cannot be opened");
    sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, static_cast<int>(kMaxChunkBytes));
    return database;
  }

  // Calls `take` for each row; it returns an error, or an empty string.
  [[nodiscard]] tl::expected<void, std::string> for_each(
      const char* query, const std::function<std::string(sqlite3_stmt*)>& take) const {
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(sqlite_.get(), query, -1, &raw, nullptr) != SQLITE_OK) {
      return Failure(message());
    }
    const Statement statement(raw);
    for (;;) {
      const int status = sqlite3_step(raw);
      if (status == SQLITE_DONE) return {};
      if (status != SQLITE_ROW) return Failure(message());
      if (const std::string wrong = take(raw); !wrong.empty()) return Failure(wrong);
    }
  }

  [[nodiscard]] tl::expected<std::vector<std::uint8_t>, std::string> data_of(
      const BagChunk& chunk) const {
    sqlite3_blob* raw = nullptr;
    const int status = sqlite3_blob_open(sqlite_.get(), "main", "messages", "data",
                                         static_cast<sqlite3_int64>(chunk.offset), 0, &raw);
    const Blob blob(raw);
    if (status != SQLITE_OK) return Failure(message());
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(sqlite3_blob_bytes(raw)));
    if (sqlite3_blob_read(raw, bytes.data(), static_cast<int>(bytes.size()), 0) != SQLITE_OK) {
      return Failure(message());
    }
    return bytes;
  }

 private:
  [[nodiscard]] std::string message() const {
    return fmt::format("sqlite3: {}", sqlite3_errmsg(sqlite_.get()));
  }

  Descriptor file_;
  std::unique_ptr<sqlite3, Close> sqlite_;
};

std::string text(sqlite3_stmt* row, int column) {
  const unsigned char* const value = sqlite3_column_text(row, column);
  return value == nullptr ? std::string() : reinterpret_cast<const char*>(value);
}

// SQLite reads zeros beyond the end of a file whose last page is cut.
// https://www.sqlite.org/fileformat2.html: page size at byte 16, number of pages at 28, big-endian.
tl::expected<void, std::string> check_size(const std::string& path) {
  const auto file = FileRange::open(path);
  if (!file) return Failure(file.error());
  constexpr std::uint64_t kHeaderBytes = 100;
  const auto header = file->read(0, kHeaderBytes);
  if (!header) return Failure("sqlite3: " + header.error());
  const auto big_endian = [&](std::size_t at, std::size_t count) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) value = value << 8U | (*header)[at + i];
    return value;
  };
  const std::uint64_t page = big_endian(16, 2) == 1 ? 65'536 : big_endian(16, 2);
  const std::uint64_t expected = page * big_endian(28, 4);
  if (file->size() >= expected) return {};
  return Failure(
      fmt::format("sqlite3: the file ends after {} of {} bytes", file->size(), expected));
}

// Views could compute anything, without end.
tl::expected<void, std::string> check_tables(const Database& database) {
  int tables = 0;
  const auto counted = database.for_each(
      "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages') AND "
      "sql NOT LIKE '%VIRTUAL%' AND sql NOT LIKE '%GENERATED%'",
      [&](sqlite3_stmt*) {
        ++tables;
        return std::string();
      });
  if (!counted) return counted;
  if (tables != 2) return Failure("no bag of ROS 2: it has no tables topics and messages");
  return {};
}

}  // namespace

tl::expected<ScannedDatabase, std::string> scan_sqlite(const std::string& path) {
  if (const auto size = check_size(path); !size) return Failure(size.error());
  auto opened = Database::open(path);
  if (!opened) return Failure(opened.error());
  const std::shared_ptr<Database> database = std::move(*opened);
  if (const auto tables = check_tables(*database); !tables) return Failure(tables.error());
  BagIndex index;
  std::map<sqlite3_int64, std::uint32_t> topics;
  const auto named = database->for_each(
      "SELECT id, name, type, serialization_format FROM topics", [&](sqlite3_stmt* row) {
        const bool is_cdr = text(row, 3) == "cdr";
        topics[sqlite3_column_int64(row, 0)] =
            index.topic_index({text(row, 1), ros1_name(text(row, 2)),
                               is_cdr ? Serialization::kCdr : Serialization::kOther, 0});
        return std::string();
      });
  if (!named) return Failure(named.error());
  const auto listed = database->for_each(
      "SELECT rowid, topic_id, length(data) FROM messages ORDER BY timestamp, rowid",
      [&](sqlite3_stmt* row) -> std::string {
        const auto topic = topics.find(sqlite3_column_int64(row, 1));
        if (topic == topics.end()) return "a message is of no topic that the bag names";
        const auto size = static_cast<std::uint32_t>(sqlite3_column_int(row, 2));
        const auto chunk = static_cast<std::uint32_t>(index.chunks.size());
        const auto id = static_cast<std::uint64_t>(sqlite3_column_int64(row, 0));
        index.chunks.push_back({id, size, size, ""});
        index.messages.push_back({topic->second, chunk, 0, size});
        return {};
      });
  if (!listed) return Failure(listed.error());
  if (const auto journal = FileRange::open(path + "-wal"); journal && journal->size() > 0) {
    index.warnings.push_back(fmt::format(
        "the recording was not closed: what is in {0}-wal is not read; add it to the bag with "
        "sqlite3 '{0}' 'PRAGMA wal_checkpoint'",
        path));
  }
  return ScannedDatabase{std::move(index),
                         [database](const BagChunk& chunk) { return database->data_of(chunk); }};
}

}  // namespace dive::estimation
