#include "mission/cli/terminal.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "mission/cli/commands.h"

namespace dive::mission {
namespace {

bool color_on(std::FILE* stream) {
  const char* no_color = std::getenv("NO_COLOR");
  return (no_color == nullptr || *no_color == '\0') && isatty(fileno(stream)) == 1;
}

int stdout_error = 0;  // the first, as errno

bool print_line(std::FILE* stream, std::string line) {
  line += '\n';  // one write: other processes may write to the same terminal
  return std::fwrite(line.data(), 1, line.size(), stream) == line.size();
}

}  // namespace

void occupy_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // Opened the wrong way round, so that using it is an error as before.
    static_cast<void>(::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

int finish_standard_output(int status) {
  std::cout.flush();  // CLI11 prints help there
  const bool was_whole = std::ferror(stdout) == 0;
  // Some systems report an error only when a file is closed.
  if (std::fclose(stdout) == 0 && was_whole) return status;
  if (stdout_error == 0) stdout_error = errno;
  complain(fmt::format("standard output: cannot be written: {}",
                       std::generic_category().message(stdout_error)));
  return kExitInternal;
}

void print(std::string_view line) {
  if (!print_line(stdout, std::string(line)) && stdout_error == 0) stdout_error = errno;
}

void note(std::string_view line) { print_line(stderr, std::string(line)); }

void complain(std::string_view message) {
  print_line(stderr, fmt::format("dive: error: {}", message));
}

void print_diagnostics(const Diagnostics& diagnostics) {
  const bool color = color_on(stderr);
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    std::fputs(render(diagnostic, color).c_str(), stderr);
  }
  const std::size_t total = diagnostics.error_count() + diagnostics.warning_count();
  if (total > 0) {
    note(fmt::format("{} error(s), {} warning(s)", diagnostics.error_count(),
                     diagnostics.warning_count()));
  }
}

std::string rounded_duration(double seconds) {
  const auto whole = std::lround(std::max(seconds, 0.0));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

std::string rounded_size(std::size_t bytes) {
  const auto size = static_cast<double>(bytes);
  return size < 1e6 ? fmt::format("{:.0f} kB", std::ceil(size / 1e3))
                    : fmt::format("{:.1f} MB", size / 1e6);
}

std::string time_left(double share, double elapsed_s) {
  if (share <= 0.0 || share >= 1.0) return "";
  return fmt::format(", {} left", rounded_duration(elapsed_s * (1.0 - share) / share));
}

ProgressLine::ProgressLine() : on_terminal_(isatty(STDERR_FILENO) == 1) {}

Utime ProgressLine::period() const {
  return on_terminal_ ? kMicrosecondsPerSecond / 10 : 10 * kMicrosecondsPerSecond;
}

ProgressLine::~ProgressLine() {
  if (open_) std::fputc('\n', stderr);
}

void ProgressLine::show(std::string_view line) {
  if (on_terminal_) {
    std::fputs(fmt::format("\r\033[K{}", line).c_str(), stderr);
    std::fflush(stderr);
    open_ = true;
  } else {
    note(line);
  }
}

void ProgressLine::clear() {
  if (open_) std::fputs("\r\033[K", stderr);
  open_ = false;
}

void ProgressLine::keep(std::string_view line) {
  clear();
  note(line);
}

void print_contacts(const NearestApproach& nearest, std::span<const Collision> collisions) {
  print("  nearest approach: " + describe(nearest));
  for (const Collision& collision : collisions) print("  collision " + describe(collision));
}

}  // namespace dive::mission
