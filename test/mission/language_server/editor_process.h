#pragma once
// `dive lsp` as an editor runs it: a process with pipes at its standard input and output.

#include <string>

#include <nlohmann/json.hpp>
#include <sys/types.h>

namespace dive::mission::testing {

class EditorProcess {
 public:
  EditorProcess();
  ~EditorProcess();
  EditorProcess(const EditorProcess&) = delete;
  EditorProcess& operator=(const EditorProcess&) = delete;

  /// Bytes as they are.
  void write(const std::string& bytes) const;
  void send(const nlohmann::json& message) const;
  void notify(const std::string& method, const nlohmann::json& params) const;
  /// The next message of the server; null at the end of its output, or after a minute.
  [[nodiscard]] nlohmann::json receive();
  /// Sends a request and returns its answer; notifications before it are dropped.
  [[nodiscard]] nlohmann::json ask(const std::string& method, const nlohmann::json& params);
  /// The next findings published for that file and, if not 0, version; others are dropped.
  [[nodiscard]] nlohmann::json findings(const std::string& uri, int version = 0);
  void initialize();
  /// Closes the pipe to the server and waits for its end: its exit status, 128 + signal if killed.
  [[nodiscard]] int end();

 private:
  [[nodiscard]] bool read_bytes(std::string& bytes, std::size_t count) const;

  pid_t process_ = -1;
  int to_server_ = -1;
  int from_server_ = -1;
  int requests_ = 0;
};

}  // namespace dive::mission::testing
