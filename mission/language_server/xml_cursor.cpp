#include "mission/language_server/xml_cursor.h"

#include <algorithm>
#include <utility>

namespace dive::mission {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

bool is_blank(char c) { return kBlanks.find(c) != std::string_view::npos; }

// What ends what begins with `open`: comments and the like, without structure of their own.
struct Opaque {
  std::string_view open;
  std::string_view close;
};
constexpr Opaque kOpaque[] = {
    {"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}, {"<!", ">"}, {"</", ">"}};

class Scan {
 public:
  Scan(std::string_view text, std::size_t cursor)
      : text_(text), cursor_(std::min(cursor, text.size())) {}

  XmlCursor run() {
    while (at_ < cursor_ && !is_found_) {
      if (text_[at_] != '<') {
        ++at_;
      } else if (!skip_opaque()) {
        read_start_tag();
      }
    }
    if (!is_found_) result_.begin = cursor_;
    return std::move(result_);
  }

 private:
  void found(CursorPlace place, std::size_t begin) {
    result_.place = place;
    result_.begin = begin;
    is_found_ = true;
  }

  // An end tag closes its element, and those in it that were not closed.
  void close(std::string_view name) {
    auto& open = result_.elements;
    for (std::size_t i = open.size(); i > 0; --i) {
      if (open[i - 1].name != name) continue;
      open.resize(i - 1);
      return;
    }
  }

  bool skip_opaque() {
    const std::string_view rest = text_.substr(at_);
    for (const Opaque& opaque : kOpaque) {
      if (!rest.starts_with(opaque.open)) continue;
      const std::size_t begin = at_;
      const std::size_t end = text_.find(opaque.close, at_ + opaque.open.size());
      at_ = end == std::string_view::npos ? text_.size() : end + opaque.close.size();
      if (at_ > cursor_ || end == std::string_view::npos) {
        found(CursorPlace::kElsewhere, cursor_);
      } else if (opaque.open == "</") {
        std::string_view name = text_.substr(begin + 2, end - begin - 2);
        close(name.substr(0, name.find_first_of(kBlanks)));
      }
      return true;
    }
    return false;
  }

  std::string word() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_blank(text_[at_]) &&
           std::string_view("<>/=\"'").find(text_[at_]) == std::string_view::npos) {
      ++at_;
    }
    return std::string(text_.substr(begin, at_ - begin));
  }

  void skip_blanks() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  }

  // The tag is read to its end, so that its element has all attributes.
  void read_start_tag() {
    const std::size_t name_begin = ++at_;
    result_.elements.push_back({word(), {}});
    if (cursor_ <= at_) found(CursorPlace::kElementName, name_begin);
    while (at_ < text_.size()) {
      skip_blanks();
      if (at_ >= text_.size() || text_[at_] == '<') break;
      if (text_[at_] == '>') {
        if (!is_found_ && cursor_ <= at_) found(CursorPlace::kTag, cursor_);
        ++at_;
        return;
      }
      if (text_.substr(at_).starts_with("/>")) {
        if (!is_found_ && cursor_ <= at_) found(CursorPlace::kTag, cursor_);
        at_ += 2;
        if (!is_found_ && cursor_ >= at_) result_.elements.pop_back();
        if (!is_found_ && cursor_ < at_) found(CursorPlace::kElsewhere, cursor_);
        return;
      }
      read_attribute();
    }
    if (!is_found_ && cursor_ <= at_) found(CursorPlace::kTag, cursor_);
  }

  void read_attribute() {
    const std::size_t begin = at_;
    if (!is_found_ && cursor_ < begin) found(CursorPlace::kTag, cursor_);
    const std::string name = word();
    if (at_ == begin) ++at_;  // a stray character
    if (!is_found_ && cursor_ <= at_) {
      found(CursorPlace::kTag, begin);
      result_.attribute = name;
    }
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != '=') return;
    ++at_;
    skip_blanks();
    if (at_ >= text_.size() || (text_[at_] != '"' && text_[at_] != '\'')) return;
    if (!is_found_ && cursor_ <= at_) found(CursorPlace::kElsewhere, cursor_);
    read_value(name);
  }

  // A value that is not closed ends where the next tag begins.
  void read_value(const std::string& name) {
    const char quote = text_[at_++];
    const std::size_t begin = at_;
    const char stops[] = {quote, '<', '\0'};
    at_ = std::min(text_.find_first_of(stops, begin), text_.size());
    if (!is_found_ && cursor_ <= at_) {
      found(CursorPlace::kAttributeValue, begin);
      result_.attribute = name;
    }
    result_.elements.back().attributes.emplace_back(name, text_.substr(begin, at_ - begin));
    if (at_ < text_.size() && text_[at_] == quote) ++at_;
  }

  std::string_view text_;
  std::size_t cursor_;
  std::size_t at_ = 0;
  bool is_found_ = false;
  XmlCursor result_;
};

}  // namespace

std::string OpenElement::value(std::string_view attribute) const {
  for (const auto& [written, content] : attributes) {
    if (written == attribute) return content;
  }
  return {};
}

XmlCursor xml_cursor(std::string_view text, std::size_t at) { return Scan(text, at).run(); }

}  // namespace dive::mission
