#include "test/mission/link/process.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test/common/file_content.h"

namespace dive::mission::testing {
namespace {

using dive::testing::content_of;

}  // namespace

Process::Process(std::vector<std::string> arguments, const std::string& folder,
                 const std::string& name)
    : output_(folder + "/" + name) {
  std::filesystem::create_directories(folder);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ != 0) return;
  const int out = open((output_ + ".out").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int err = open((output_ + ".err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  if (chdir(folder.c_str()) == 0) execv(argv[0], argv.data());
  _exit(127);
}

Process::~Process() {
  if (pid_ <= 0 || status_ >= 0) return;
  kill(SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void Process::kill(int signal) const { ::kill(pid_, signal); }

int Process::wait(double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  int status = 0;
  while (status_ < 0 && Clock::now() < deadline) {
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  return status_;
}

std::string Process::out() const { return content_of(output_ + ".out"); }
std::string Process::err() const { return content_of(output_ + ".err"); }

}  // namespace dive::mission::testing
