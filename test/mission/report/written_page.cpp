#include "test/mission/report/written_page.h"

#include <array>
#include <cstring>
#include <stdexcept>

namespace dive::mission::testing {
namespace {

std::string bytes_of(const std::string& base64) {
  static const std::string kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : base64) {
    if (c == '=') break;
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string::npos) throw std::runtime_error("not base64");
    bits = (bits << 6U) | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>((bits >> count) & 0xFFU);
  }
  return bytes;
}

template <typename Value>
std::vector<Value> values_of(const nlohmann::json& packed, const char* type) {
  const std::string bytes = bytes_of(packed.at(type).get<std::string>());
  std::vector<Value> values(bytes.size() / sizeof(Value));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Value));
  return values;
}

}  // namespace

nlohmann::json data_of(const std::string& page) {
  const std::string begin = "<script type=\"application/json\" id=\"report-data\">";
  const std::size_t at = page.find(begin);
  if (at == std::string::npos) throw std::runtime_error("the page has no data");
  const std::size_t end = page.find("</script", at);
  return nlohmann::json::parse(page.substr(at + begin.size(), end - at - begin.size()));
}

std::vector<float> floats_of(const nlohmann::json& packed) {
  return values_of<float>(packed, "f32");
}

std::vector<std::int16_t> shorts_of(const nlohmann::json& packed) {
  return values_of<std::int16_t>(packed, "i16");
}

std::size_t count_of(std::string_view text, std::string_view word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string_view::npos;
       at = text.find(word, at + 1)) {
    ++count;
  }
  return count;
}

}  // namespace dive::mission::testing
