#pragma once
// A program that runs beside the test, with its output in files of a given folder.

#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/types.h>

namespace dive::mission::testing {

class Process {
 public:
  /// `arguments[0]` is the program. Its output files in `folder` are named after `name`.
  Process(std::vector<std::string> arguments, const std::string& folder, const std::string& name);
  /// Kills the process.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void kill(int signal) const;
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Exit status, 128 + signal, or -1 if it still runs after `seconds`.
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
