#pragma once
// JSON-RPC 2.0 messages framed by a header, as the Language Server Protocol 3.17 prescribes:
// "Content-Length: N\r\n\r\n" and N bytes of JSON.

#include <cstddef>
#include <iosfwd>
#include <mutex>
#include <string>
#include <variant>

#include <nlohmann/json.hpp>

namespace dive::mission {

/// Error codes of JSON-RPC and of the protocol.
enum class RpcError {
  kParse = -32700,
  kInvalidRequest = -32600,
  kMethodNotFound = -32601,
  kInvalidParams = -32602,
  kInternal = -32603,
  kNotInitialized = -32002,
};

/// A message that cannot be read, in words. Reading may continue.
struct MalformedMessage {
  std::string reason;
};
struct EndOfMessages {};
using IncomingMessage = std::variant<nlohmann::json, MalformedMessage, EndOfMessages>;

inline constexpr std::size_t kMaxMessageBytes = 16U << 20U;

/// Reads the next message. A wrong header is skipped up to its empty line, a message of more than
/// kMaxMessageBytes to its end.
[[nodiscard]] IncomingMessage read_message(std::istream& input);

/// Writes whole messages; any thread may call it.
class MessageWriter {
 public:
  explicit MessageWriter(std::ostream& output) : output_(output) {}

  void respond(const nlohmann::json& id, nlohmann::json result);
  void fail(const nlohmann::json& id, RpcError code, const std::string& message);
  void notify(const std::string& method, nlohmann::json params);

 private:
  void write(const nlohmann::json& message);

  std::ostream& output_;
  std::mutex mutex_;
};

}  // namespace dive::mission
