#include "mission/language_server/language_server.h"

#include <utility>

#include <fmt/format.h>

#include "mission/language_server/editor_help.h"
#include "mission/language_server/leg_hover.h"
#include "mission/language_server/text_position.h"
#include "mission/language_server/xml_cursor.h"

namespace dive::mission {
namespace {

using nlohmann::json;

json to_json(const EditorPosition& position) {
  return {{"line", position.line}, {"character", position.character}};
}

json to_json(const EditorRange& range) {
  return {{"start", to_json(range.start)}, {"end", to_json(range.end)}};
}

json to_json(const Diagnostic& finding) {
  constexpr int kSeverityError = 1;
  constexpr int kSeverityWarning = 2;
  constexpr int kSeverityInformation = 3;
  int severity = kSeverityInformation;
  if (finding.severity == Severity::kError) severity = kSeverityError;
  if (finding.severity == Severity::kWarning) severity = kSeverityWarning;
  std::string message = finding.message;
  if (!finding.hint.empty()) message += "\n" + finding.hint;
  return {{"range", to_json(range_of(finding.span, finding.source_line))},
          {"severity", severity},
          {"code", finding.code},
          {"source", "dive"},
          {"message", std::move(message)}};
}

json to_json(const Completion& completion, const EditorRange& replaced) {
  constexpr int kKinds[] = {/* Class */ 7, /* Property */ 10, /* EnumMember */ 20};
  return {{"label", completion.label},
          {"kind", kKinds[static_cast<std::size_t>(completion.kind)]},
          {"detail", completion.detail},
          {"documentation", completion.documentation},
          // What is required comes first.
          {"sortText", (completion.is_required ? "0" : "1") + completion.label},
          {"filterText", completion.insert},
          {"textEdit", {{"range", to_json(replaced)}, {"newText", completion.insert}}}};
}

EditorPosition position_in(const json& params) {
  const json& position = params.at("position");
  return {position.at("line").get<int>(), position.at("character").get<int>()};
}

json capabilities(const std::string& version) {
  constexpr int kFullText = 1;
  return {{"capabilities",
           {{"positionEncoding", "utf-16"},
            {"textDocumentSync", {{"openClose", true}, {"change", kFullText}}},
            {"completionProvider", {{"triggerCharacters", {"<", " ", "\""}}}},
            {"hoverProvider", true}}},
          {"serverInfo", {{"name", "dive"}, {"version", version}}}};
}

}  // namespace

LanguageServer::LanguageServer(std::istream& input, std::ostream& output, std::string version,
                               TextChecker checker)
    : input_(input),
      writer_(output),
      version_(std::move(version)),
      language_(mission_schema()),
      check_(std::move(checker), [this](const BackgroundCheck::Request& request,
                                        const CheckedText& result) { publish(request, result); }) {}

int LanguageServer::serve() {
  while (!ends_) {
    IncomingMessage message = read_message(input_);
    if (std::holds_alternative<EndOfMessages>(message)) break;
    if (const auto* malformed = std::get_if<MalformedMessage>(&message)) {
      writer_.fail(nullptr, RpcError::kParse, malformed->reason);
    } else {
      take(std::get<json>(message));
    }
  }
  return ends_ && is_shut_down_ ? 0 : 1;
}

void LanguageServer::take(const json& message) {
  const json none;
  const bool has_id = message.is_object() && message.contains("id");
  const json id = has_id ? message.at("id") : none;
  if (!message.is_object() || !message.contains("method") || !message.at("method").is_string()) {
    // An answer to a request has no method; we send none that is answered.
    const bool is_answer =
        message.is_object() && has_id && (message.contains("result") || message.contains("error"));
    if (!is_answer) writer_.fail(id, RpcError::kInvalidRequest, "this is not a request");
    return;
  }
  const auto method = message.at("method").get<std::string>();
  const json params = message.value("params", json::object());
  try {
    if (has_id) {
      answer(id, method, params);
    } else {
      obey(method, params);
    }
  } catch (const json::exception& error) {
    if (has_id) writer_.fail(id, RpcError::kInvalidParams, error.what());
  }
}

void LanguageServer::answer(const json& id, const std::string& method, const json& params) {
  if (is_shut_down_) {
    writer_.fail(id, RpcError::kInvalidRequest, "the server is shut down");
  } else if (method == "initialize") {
    is_initialized_ = true;
    writer_.respond(id, capabilities(version_));
  } else if (!is_initialized_) {
    writer_.fail(id, RpcError::kNotInitialized, "initialize comes first");
  } else if (method == "shutdown") {
    is_shut_down_ = true;
    writer_.respond(id, nullptr);
  } else if (method == "textDocument/completion") {
    writer_.respond(id, complete(params));
  } else if (method == "textDocument/hover") {
    writer_.respond(id, hover(params));
  } else {
    writer_.fail(id, RpcError::kMethodNotFound, fmt::format("there is no method '{}'", method));
  }
}

// Notifications have no answer; those that the server does not know are ignored.
void LanguageServer::obey(const std::string& method, const json& params) {
  if (method == "exit") {
    ends_ = true;
    return;
  }
  if (!is_initialized_ || is_shut_down_ || !method.starts_with("textDocument/")) return;
  const json& described = params.at("textDocument");
  const auto uri = described.at("uri").get<std::string>();
  if (method == "textDocument/didOpen") {
    change(uri, described.at("version").get<int>(), described.at("text").get<std::string>());
  } else if (method == "textDocument/didChange") {
    // The whole text: the last of several changes is the present one.
    const json& changes = params.at("contentChanges");
    if (changes.empty() || changes.back().contains("range")) return;
    change(uri, described.at("version").get<int>(), changes.back().at("text").get<std::string>());
  } else if (method == "textDocument/didClose") {
    close(uri);
  }
}

void LanguageServer::change(const std::string& uri, int version, std::string text) {
  {
    const std::lock_guard lock(mutex_);
    documents_[uri] = {text, version, std::nullopt};
  }
  check_.check({uri, version, std::move(text)});
}

void LanguageServer::close(const std::string& uri) {
  check_.forget(uri);
  const std::lock_guard lock(mutex_);
  documents_.erase(uri);
  for (const std::string& file : marked_[uri]) {
    writer_.notify("textDocument/publishDiagnostics",
                   {{"uri", file}, {"diagnostics", json::array()}});
  }
  marked_.erase(uri);
}

void LanguageServer::publish(const BackgroundCheck::Request& request, const CheckedText& result) {
  const std::string path = path_of_uri(request.uri);
  std::map<std::string, json> findings;
  findings[request.uri] = json::array();
  for (const Diagnostic& finding : result.findings) {
    const bool is_here = finding.file.empty() || finding.file == path;
    const std::string uri = is_here ? request.uri : uri_of_path(finding.file);
    findings.try_emplace(uri, json::array()).first->second.push_back(to_json(finding));
  }
  const std::lock_guard lock(mutex_);
  const auto document = documents_.find(request.uri);
  if (document == documents_.end() || document->second.version != request.version) return;
  document->second.legs = result.legs;
  std::set<std::string>& marked = marked_[request.uri];
  for (const std::string& uri : marked) findings.try_emplace(uri, json::array());
  marked.clear();
  for (auto& [uri, list] : findings) {
    if (!list.empty()) marked.insert(uri);
    json params = {{"uri", uri}, {"diagnostics", std::move(list)}};
    if (uri == request.uri) params["version"] = request.version;
    writer_.notify("textDocument/publishDiagnostics", std::move(params));
  }
}

LanguageServer::Document LanguageServer::document(const json& params) {
  const auto uri = params.at("textDocument").at("uri").get<std::string>();
  const std::lock_guard lock(mutex_);
  const auto found = documents_.find(uri);
  if (found != documents_.end()) return found->second;
  constexpr int kKeyNotFound = 403;
  throw json::out_of_range::create(kKeyNotFound, fmt::format("'{}' is not open", uri), nullptr);
}

json LanguageServer::complete(const json& params) {
  const Document present = document(params);
  const EditorPosition position = position_in(params);
  const std::size_t at = offset_of(present.text, position);
  const XmlCursor cursor = xml_cursor(present.text, at);
  // What is replaced is written in front of the cursor, in its line.
  const std::string_view written =
      std::string_view(present.text).substr(cursor.begin, at - cursor.begin);
  EditorRange replaced = {position, position};
  if (written.find('\n') == std::string_view::npos) {
    replaced.start.character -= utf16_length(written);
  }
  json items = json::array();
  for (const Completion& completion : completions(cursor, language_)) {
    items.push_back(to_json(completion, replaced));
  }
  return {{"isIncomplete", false}, {"items", std::move(items)}};
}

json LanguageServer::hover(const json& params) {
  const Document present = document(params);
  const std::size_t at = offset_of(present.text, position_in(params));
  const XmlCursor cursor = xml_cursor(present.text, at);
  std::string text;
  if (makes_legs(cursor) && cursor.place != CursorPlace::kContent) {
    text = present.legs ? describe(legs_at(cursor, *present.legs)) : "The path is being planned.";
    if (text.empty()) text = "No path is planned: see the errors of this mission.";
  }
  if (const std::string words = meaning(cursor, language_);
      !words.empty() && cursor.place != CursorPlace::kContent) {
    text += (text.empty() ? "" : "\n\n") + words;
  }
  if (text.empty()) return nullptr;
  return {{"contents", {{"kind", "markdown"}, {"value", text}}}};
}

}  // namespace dive::mission
