#include "mission/language_server/json_rpc.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <istream>
#include <optional>
#include <ostream>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace dive::mission {
namespace {

constexpr std::string_view kLength = "content-length:";
constexpr std::size_t kMaxHeaderLine = 1024;

// One line of a header without its line break; longer ones are cut. False at the end of the input.
bool read_line(std::istream& input, std::string& line) {
  line.clear();
  for (int c = input.get(); c != std::istream::traits_type::eof(); c = input.get()) {
    if (c == '\n') {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      return true;
    }
    if (line.size() < kMaxHeaderLine) line += static_cast<char>(c);
  }
  return false;
}

bool is_length_field(std::string_view line) {
  if (line.size() < kLength.size()) return false;
  for (std::size_t i = 0; i < kLength.size(); ++i) {
    const bool is_upper = line[i] >= 'A' && line[i] <= 'Z';
    const char lower = is_upper ? static_cast<char>(line[i] - 'A' + 'a') : line[i];
    if (lower != kLength[i]) return false;
  }
  return true;
}

std::optional<std::size_t> length_in(std::string_view line) {
  line.remove_prefix(kLength.size());
  while (line.starts_with(' ')) line.remove_prefix(1);
  std::size_t length = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), length);
  if (error != std::errc() || end != line.data() + line.size()) return std::nullopt;
  return length;
}

// istream::ignore() waits for the byte after them.
void skip(std::istream& input, std::size_t bytes) {
  std::array<char, 4096> skipped;
  while (bytes > 0 && input) {
    const std::size_t count = std::min(bytes, skipped.size());
    input.read(skipped.data(), static_cast<std::streamsize>(count));
    bytes -= count;
  }
}

}  // namespace

IncomingMessage read_message(std::istream& input) {
  std::optional<std::size_t> length;
  std::string wrong;
  std::string line;
  do {
    if (!read_line(input, line)) return EndOfMessages{};
    if (!is_length_field(line)) continue;
    length = length_in(line);
    if (!length) wrong = fmt::format("'{}' does not state a number of bytes", line);
  } while (!line.empty());
  if (!length) {
    return MalformedMessage{wrong.empty() ? "the header lacks Content-Length" : wrong};
  }
  if (*length > kMaxMessageBytes) {
    skip(input, *length);
    return MalformedMessage{
        fmt::format("a message of {} bytes; the most is {}", *length, kMaxMessageBytes)};
  }
  std::string body(*length, '\0');
  input.read(body.data(), static_cast<std::streamsize>(*length));
  if (static_cast<std::size_t>(input.gcount()) != *length) return EndOfMessages{};
  nlohmann::json message = nlohmann::json::parse(body, nullptr, false);
  if (message.is_discarded()) return MalformedMessage{"the content is not JSON"};
  return IncomingMessage(std::in_place_type<nlohmann::json>, std::move(message));
}

void MessageWriter::respond(const nlohmann::json& id, nlohmann::json result) {
  write({{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(result)}});
}

void MessageWriter::fail(const nlohmann::json& id, RpcError code, const std::string& message) {
  write({{"jsonrpc", "2.0"},
         {"id", id},
         {"error", {{"code", static_cast<int>(code)}, {"message", message}}}});
}

void MessageWriter::notify(const std::string& method, nlohmann::json params) {
  write({{"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(params)}});
}

void MessageWriter::write(const nlohmann::json& message) {
  // A file may hold bytes that are not UTF-8; what quotes them must still be JSON.
  const std::string body = message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  const std::lock_guard lock(mutex_);
  output_ << "Content-Length: " << body.size() << "\r\n\r\n" << body << std::flush;
}

}  // namespace dive::mission
