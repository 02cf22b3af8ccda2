#pragma once
// A program that runs beside the test, with its output in files of a folder of its own.

#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/types.h>

namespace dive::mission::testing {

class Process {
 public:
  /// `arguments[0]` is the program. `name` names its output in `folder`.
  Process(std::vector<std::string> arguments, const std::string& folder, const std::string& name);
  /// Kills it.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void kill(int signal) const;
  /// Exit status, 128 + signal, or -1 when it still runs after so many seconds.
  int wait(double seconds);
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;
  [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(out()); }

 private:
  std::string output_;
  pid_t pid_ = -1;
  int status_ = -1;
};

}  // namespace dive::mission::testing
