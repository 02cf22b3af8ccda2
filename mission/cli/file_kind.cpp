#include "mission/cli/file_kind.h"

#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "common/input_file.h"
#include "common/source_text.h"
#include "mission/bundle/bundle.h"
#include "mission/record/log_frame.h"
#include "planning/cloud/cloud_file.h"
#include "planning/world/grid.h"

namespace dive::mission {
namespace {

constexpr std::size_t kHeadBytes = 64U << 10U;
constexpr std::string_view kBlanks = " \t\r\n";

constexpr std::array<std::pair<std::string_view, FileKind>, 3> kRoots{
    {{"mission", FileKind::kMission}, {"scenario", FileKind::kScenario}, {"sdf", FileKind::kMap}}};

std::string head_of(const std::string& path) {
  const auto file = open_input_stream(path);
  if (!file) return {};
  std::string head(kHeadBytes, '\0');
  (*file)->read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>((*file)->gcount()));
  return head;
}

// Local name of the first start tag, after declarations and comments; empty if not XML.
std::string_view root_name(std::string_view text) {
  while (true) {
    const std::size_t begin = text.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos || text[begin] != '<') return {};
    text.remove_prefix(begin + 1);
    if (text.empty() || (text.front() != '?' && text.front() != '!')) break;
    const std::string_view end = text.starts_with("!--") ? "-->" : ">";
    const std::size_t at = text.find(end);
    if (at == std::string_view::npos) return {};
    text.remove_prefix(at + end.size());
  }
  const std::string_view name = text.substr(0, text.find_first_of(" \t\r\n/>"));
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

}  // namespace

const char* in_words(FileKind kind) {
  switch (kind) {
    case FileKind::kMission:
      return "a mission";
    case FileKind::kScenario:
      return "a scenario";
    case FileKind::kMap:
      return "a map";
    case FileKind::kCloud:
      return "a point cloud";
    case FileKind::kLog:
      return "a log";
    case FileKind::kBundle:
      return "a verified bundle";
    case FileKind::kJson:
      return "JSON";
    case FileKind::kUnknown:
      break;
  }
  return "a file of unknown kind";
}

FileKind kind_of_file(const std::string& path) {
  const std::string head = head_of(path);
  std::string_view text = head;
  if (begins_like_bundle(text)) return FileKind::kBundle;  // its records are those of a log
  if (planning::begins_like_grid(text)) return FileKind::kMap;
  if (begins_like_log(text)) return FileKind::kLog;
  if (planning::begins_like_cloud(text)) return FileKind::kCloud;
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first != std::string_view::npos && text[first] == '{') return FileKind::kJson;
  const std::string_view root = root_name(text);
  for (const auto& [name, kind] : kRoots) {
    if (root == name) return kind;
  }
  return FileKind::kUnknown;
}

bool is_text_of(FileKind expected, const std::string& path, Diagnostics& diagnostics) {
  const FileKind kind = kind_of_file(path);
  if (kind != FileKind::kBundle && kind != FileKind::kLog) return true;
  Diagnostic diagnostic;
  diagnostic.code = "FILE-KIND";
  diagnostic.file = path;
  diagnostic.message = fmt::format("this is {}, not {}", in_words(kind), in_words(expected));
  diagnostic.hint = kind == FileKind::kBundle
                        ? "dive run, supervise, graph, diff and replay --mission take a bundle; "
                          "give other commands the mission that it was made of"
                        : "dive explain, report, replay, diff, export and fit take a log";
  diagnostics.add(std::move(diagnostic));
  return false;
}

}  // namespace dive::mission
