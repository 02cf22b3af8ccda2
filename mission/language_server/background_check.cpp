#include "mission/language_server/background_check.h"

#include <exception>
#include <utility>

#include <fmt/format.h>

#include "mission/language_server/text_position.h"

namespace dive::mission {

BackgroundCheck::BackgroundCheck(TextChecker checker, Done done)
    : checker_(std::move(checker)), done_(std::move(done)), thread_([this] { run(); }) {}

BackgroundCheck::~BackgroundCheck() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void BackgroundCheck::check(Request request) {
  {
    const std::lock_guard lock(mutex_);
    newest_[request.uri] = ++tickets_;
    std::erase_if(waiting_, [&](const Request& other) { return other.uri == request.uri; });
    waiting_.push_back(std::move(request));
  }
  wake_.notify_one();
}

void BackgroundCheck::forget(const std::string& uri) {
  const std::lock_guard lock(mutex_);
  newest_.erase(uri);
  std::erase_if(waiting_, [&](const Request& other) { return other.uri == uri; });
}

bool BackgroundCheck::is_outdated(const std::string& uri, std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  const auto newest = newest_.find(uri);
  return ends_ || newest == newest_.end() || newest->second != ticket;
}

// A mistake of ours must not end the editor's server.
std::optional<CheckedText> BackgroundCheck::checked(
    const Request& request, const std::function<bool()>& is_outdated) const {
  const SourceText text(path_of_uri(request.uri), request.text);
  try {
    return checker_(text, is_outdated);
  } catch (const std::exception& error) {
    Diagnostics diagnostics;
    diagnostics.error("CHK-INTERNAL", text, {},
                      fmt::format("this text cannot be checked: internal error: {}", error.what()),
                      "please report it with this text");
    return CheckedText{diagnostics.list(), {}};
  }
}

void BackgroundCheck::run() {
  while (true) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return ends_ || !waiting_.empty(); });
    if (ends_) return;
    const Request request = std::move(waiting_.front());
    waiting_.erase(waiting_.begin());
    const std::uint64_t ticket = newest_[request.uri];
    lock.unlock();
    const auto outdated = [&] { return is_outdated(request.uri, ticket); };
    const std::optional<CheckedText> result = checked(request, outdated);
    if (result && !outdated()) done_(request, *result);
  }
}

}  // namespace dive::mission
