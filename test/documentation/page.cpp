#include "test/documentation/page.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string_view>

#include <fmt/format.h>
#include <sys/wait.h>

#include "test/common/file_content.h"

namespace dive::documentation {
namespace {

namespace fs = std::filesystem;
using dive::testing::content_of;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    line.erase(line.find_last_not_of(" \r") + 1);
    lines.push_back(line);
  }
  return lines;
}

// On a terminal progress is a line that is replaced, and gone in the end.
bool is_progress(const std::string& line) {
  static const std::regex pattern(
      R"(check: .*|dive: decomposing .*| +[0-9.]+ s  .* to go .*|\S+: \d+ of \d+ .*)");
  return std::regex_match(line, pattern);
}

bool matches(std::string_view line, std::string_view pattern) {
  const std::size_t gap = pattern.find("...");
  if (gap == std::string_view::npos) return line == pattern;
  if (line.substr(0, gap) != pattern.substr(0, gap)) return false;
  const std::string_view rest = pattern.substr(gap + 3);
  for (std::size_t begin = gap; begin <= line.size(); ++begin) {
    if (matches(line.substr(begin), rest)) return true;
  }
  return false;
}

struct Ran {
  int status = 0;
  std::string output;
};

Ran run(const std::string& command, int last_status, const fs::path& folder,
        const std::string& path) {
  const fs::path script = folder / ".step";
  std::ofstream(script) << "(exit " << last_status << ")\n" << command << "\n";
  const std::string line = fmt::format(
      "cd '{}' && PATH='{}':\"$PATH\" DIVE='{}' NO_COLOR=1 bash .step >.output 2>&1 </dev/null",
      folder.string(), path, DIVE_SOURCE_DIR);
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, content_of(folder / ".output")};
}

}  // namespace

std::vector<Step> steps_of(const std::string& page) {
  static const std::regex fence(R"(```(\w+)( +(\S+))?)");
  std::vector<Step> steps;
  bool is_inside = false;
  bool is_console = false;
  bool is_file = false;
  int number = 0;
  for (const std::string& line : lines_of(page)) {
    ++number;
    std::smatch words;
    if (is_inside && line == "```") {
      is_inside = is_console = is_file = false;
    } else if (!is_inside && std::regex_match(line, words, fence)) {
      is_inside = true;
      is_console = words[1] == "console";
      is_file = words[3].matched;
      if (is_file) steps.push_back({number, "", {}, words[3]});
    } else if (is_console && line.starts_with("$ ")) {
      steps.push_back({number, line.substr(2), {}, ""});
    } else if (is_console && line.starts_with("> ") && !steps.empty() &&
               steps.back().expected.empty()) {
      steps.back().command += "\n" + line.substr(2);
    } else if ((is_console || is_file) && !steps.empty()) {
      steps.back().expected.push_back(line);
    }
  }
  return steps;
}

std::string difference(const std::vector<std::string>& expected, const std::string& output) {
  std::vector<std::string> lines = lines_of(output);
  std::erase_if(lines, is_progress);
  std::size_t next = 0;
  bool may_skip = false;
  for (const std::string& line : expected) {
    if (line == "...") {
      may_skip = true;
      continue;
    }
    std::size_t found = next;
    while (found < lines.size() && !matches(lines[found], line)) ++found;
    if (found == lines.size()) return fmt::format("it does not print: {}", line);
    if (found > next && !may_skip) {
      return fmt::format("the page leaves out without '...': {}", lines[next]);
    }
    next = found + 1;
    may_skip = false;
  }
  if (next < lines.size() && !may_skip) {
    return fmt::format("the page leaves out without '...': {}", lines[next]);
  }
  return "";
}

std::vector<std::string> mistakes_in(const std::vector<Step>& steps, const fs::path& folder,
                                     const std::string& path) {
  std::vector<std::string> mistakes;
  int status = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    if (!step.file.empty()) {
      std::ofstream stream(folder / step.file);
      for (const std::string& line : step.expected) stream << line << "\n";
      continue;
    }
    const Ran ran = run(step.command, status, folder, path);
    status = ran.status;
    const auto complain = [&](const std::string& what) {
      mistakes.push_back(fmt::format("line {}: $ {}\n  {}\n  all of its output:\n{}", step.line,
                                     step.command, what, ran.output));
    };
    const bool is_stated = i + 1 < steps.size() && steps[i + 1].command == "echo $?";
    if (status != 0 && !is_stated) complain(fmt::format("its exit status is {}", status));
    if (const std::string what = difference(step.expected, ran.output); !what.empty()) {
      complain(what);
    }
  }
  return mistakes;
}

std::vector<std::string> linked_files(const std::string& page) {
  static const std::regex link(R"(\]\(([^)#:\s]+)(#[^)]*)?\))");
  std::vector<std::string> files;
  for (std::sregex_iterator found(page.begin(), page.end(), link), end; found != end; ++found) {
    files.push_back((*found)[1]);
  }
  return files;
}

}  // namespace dive::documentation
