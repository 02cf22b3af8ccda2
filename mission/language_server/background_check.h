#pragma once
// Checks the texts of an editor on a thread of its own, so that typing never waits for a plan.

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "mission/language_server/leg_hover.h"

namespace dive::mission {

struct CheckedText {
  std::vector<Diagnostic> findings;
  std::vector<CheckedLeg> legs;
};

/// Checks a text. `is_outdated` may be asked at any time; once it is true the result is not used,
/// and nothing need be returned. An exception becomes a finding.
using TextChecker = std::function<std::optional<CheckedText>(
    const SourceText& text, const std::function<bool()>& is_outdated)>;

class BackgroundCheck {
 public:
  /// The text of a document, or none for one that was closed; `version` is the editor's.
  struct Request {
    std::string uri;
    int version = 0;
    std::string text;
  };
  /// Called on the thread, only for the newest text of its document.
  using Done = std::function<void(const Request& request, const CheckedText& result)>;

  BackgroundCheck(TextChecker checker, Done done);
  ~BackgroundCheck();
  BackgroundCheck(const BackgroundCheck&) = delete;
  BackgroundCheck& operator=(const BackgroundCheck&) = delete;

  /// Replaces a waiting or running check of the same document.
  void check(Request request);
  void forget(const std::string& uri);

 private:
  void run();
  [[nodiscard]] std::optional<CheckedText> checked(const Request& request,
                                                   const std::function<bool()>& is_outdated) const;
  bool is_outdated(const std::string& uri, std::uint64_t ticket);

  TextChecker checker_;
  Done done_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Request> waiting_;
  std::map<std::string, std::uint64_t> newest_;  ///< Ticket of the newest text of each document.
  std::uint64_t tickets_ = 0;
  bool ends_ = false;
  std::thread thread_;  ///< Last: it uses the others.
};

}  // namespace dive::mission
