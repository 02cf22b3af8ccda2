#include "test/mission/language_server/editor_process.h"

#include <array>
#include <csignal>

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

namespace dive::mission::testing {

using nlohmann::json;

EditorProcess::EditorProcess() {
  std::signal(SIGPIPE, SIG_IGN);
  std::array<int, 2> in{};
  std::array<int, 2> out{};
  if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0) return;
  process_ = ::fork();
  if (process_ == 0) {
    ::dup2(in[0], STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::execl(DIVE_COMMAND, "dive", "lsp", "--stdio", nullptr);
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  to_server_ = in[1];
  from_server_ = out[0];
}

EditorProcess::~EditorProcess() {
  if (to_server_ >= 0) ::close(to_server_);
  if (from_server_ >= 0) ::close(from_server_);
  if (process_ > 0) {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
}

void EditorProcess::write(const std::string& bytes) const {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::write(to_server_, bytes.data() + done, bytes.size() - done);
    if (count <= 0) return;
    done += static_cast<std::size_t>(count);
  }
}

void EditorProcess::send(const json& message) const {
  const std::string body = message.dump();
  write("Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
}

void EditorProcess::notify(const std::string& method, const json& params) const {
  send({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
}

bool EditorProcess::read_bytes(std::string& bytes, std::size_t count) const {
  constexpr int kTimeoutMs = 60'000;
  while (count > 0) {
    pollfd ready{from_server_, POLLIN, 0};
    if (::poll(&ready, 1, kTimeoutMs) != 1) return false;
    std::string part(count, '\0');
    const ssize_t got = ::read(from_server_, part.data(), count);
    if (got <= 0) return false;
    bytes.append(part, 0, static_cast<std::size_t>(got));
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

json EditorProcess::receive() {
  std::string header;
  while (!header.ends_with("\r\n\r\n")) {
    if (!read_bytes(header, 1)) return nullptr;
  }
  const std::string name = "Content-Length: ";
  if (!header.starts_with(name)) return nullptr;
  std::string body;
  if (!read_bytes(body, std::stoul(header.substr(name.size())))) return nullptr;
  return json::parse(body);
}

json EditorProcess::ask(const std::string& method, const json& params) {
  const int id = ++requests_;
  send({{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}});
  for (json message = receive(); !message.is_null(); message = receive()) {
    if (message.contains("id") && message.at("id") == id) return message;
  }
  return nullptr;
}

json EditorProcess::findings(const std::string& uri, int version) {
  for (json message = receive(); !message.is_null(); message = receive()) {
    if (message.value("method", "") != "textDocument/publishDiagnostics") continue;
    const json& params = message.at("params");
    if (params.at("uri") != uri) continue;
    if (version == 0 || params.value("version", 0) == version) return params.at("diagnostics");
  }
  return nullptr;
}

void EditorProcess::initialize() {
  (void)ask("initialize",
            {{"processId", nullptr}, {"rootUri", nullptr}, {"capabilities", json::object()}});
  notify("initialized", json::object());
}

int EditorProcess::end() {
  ::close(to_server_);
  to_server_ = -1;
  int status = 0;
  ::waitpid(process_, &status, 0);
  process_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace dive::mission::testing
