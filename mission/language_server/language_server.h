#pragma once
// A language server for missions: Language Server Protocol 3.17 over a pair of streams. It
// publishes the findings of a check, completes by the schema, and shows on a leg its certified
// clearance.
//
// Thread: serve() reads and answers; checks run on a thread of their own, which publishes findings.
// A message that cannot be read, an unknown method or wrong parameters are answered with an error.

#include <iosfwd>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "mission/document/language.h"
#include "mission/language_server/background_check.h"
#include "mission/language_server/json_rpc.h"

namespace dive::mission {

class LanguageServer {
 public:
  /// `version` is that of the program; `checker` runs on the server's thread.
  LanguageServer(std::istream& input, std::ostream& output, std::string version,
                 TextChecker checker);

  /// Until the client sends `exit`, or the input ends. Returns the exit status: 0 after a
  /// `shutdown`, otherwise 1.
  [[nodiscard]] int serve();

 private:
  struct Document {
    std::string text;
    int version = 0;
    std::optional<std::vector<CheckedLeg>> legs;  ///< Of this version, when they are planned.
  };

  void take(const nlohmann::json& message);
  void answer(const nlohmann::json& id, const std::string& method, const nlohmann::json& params);
  void obey(const std::string& method, const nlohmann::json& params);
  void change(const std::string& uri, int version, std::string text);
  void close(const std::string& uri);
  void publish(const BackgroundCheck::Request& request, const CheckedText& result);
  [[nodiscard]] nlohmann::json complete(const nlohmann::json& params);
  [[nodiscard]] nlohmann::json hover(const nlohmann::json& params);
  /// A copy of an open document; throws nlohmann::json::out_of_range if it is not open.
  [[nodiscard]] Document document(const nlohmann::json& params);

  std::istream& input_;
  MessageWriter writer_;
  std::string version_;
  Language language_;
  bool is_initialized_ = false;
  bool is_shut_down_ = false;
  bool ends_ = false;
  std::mutex mutex_;  ///< For what follows.
  std::map<std::string, Document> documents_;
  std::map<std::string, std::set<std::string>> marked_;  ///< Files with findings, by document.
  BackgroundCheck check_;                                ///< Last: its thread uses the others.
};

}  // namespace dive::mission
