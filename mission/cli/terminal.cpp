#include "mission/cli/terminal.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

namespace dive::mission {
namespace {

bool color_on(std::FILE* stream) {
  const char* no_color = std::getenv("NO_COLOR");
  return (no_color == nullptr || *no_color == '\0') && isatty(fileno(stream)) == 1;
}

}  // namespace

void print(std::string_view line) { fmt::print(stdout, "{}\n", line); }

void note(std::string_view line) { fmt::print(stderr, "{}\n", line); }

void complain(std::string_view message) { fmt::print(stderr, "dive: error: {}\n", message); }

void print_diagnostics(const Diagnostics& diagnostics) {
  const bool color = color_on(stderr);
  for (const Diagnostic& diagnostic : diagnostics.list()) {
    fmt::print(stderr, "{}", render(diagnostic, color));
  }
  const std::size_t total = diagnostics.error_count() + diagnostics.warning_count();
  if (total > 0) {
    fmt::print(stderr, "{} error(s), {} warning(s)\n", diagnostics.error_count(),
               diagnostics.warning_count());
  }
}

bool write_file(const std::string& path, std::string_view content) {
  std::ofstream stream(path, std::ios::binary);
  stream << content;
  stream.close();
  if (stream) return true;
  complain(fmt::format("{}: cannot be written", path));
  return false;
}

ProgressLine::ProgressLine() : on_terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
  if (open_) fmt::print(stderr, "\n");
}

void ProgressLine::show(std::string_view line) {
  if (on_terminal_) {
    fmt::print(stderr, "\r\033[K{}", line);
    std::fflush(stderr);
    open_ = true;
  } else {
    note(line);
  }
}

void ProgressLine::keep(std::string_view line) {
  if (open_) fmt::print(stderr, "\r\033[K");
  open_ = false;
  note(line);
}

void print_contacts(const NearestApproach& nearest, std::span<const Collision> collisions) {
  print("  nearest approach: " + describe(nearest));
  for (const Collision& collision : collisions) print("  collision " + describe(collision));
}

}  // namespace dive::mission
