// `dive lsp`, driven as by an editor over pipes.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/common/file_content.h"
#include "test/mission/language_server/editor_process.h"

namespace dive::mission::testing {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kParseError = -32700;
constexpr int kInvalidRequest = -32600;
constexpr int kMethodNotFound = -32601;
constexpr int kInvalidParams = -32602;
constexpr int kNotInitialized = -32002;

const std::string kPath = DIVE_SOURCE_DIR "/missions/penetration.xml";
const std::string kUri = "file://" + kPath;

std::string mission_text() { return dive::testing::content_of(kPath); }

std::string replaced(std::string text, const std::string& old, const std::string& by) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), by);
}

json opened(const std::string& text, int version = 1) {
  return {{"textDocument",
           {{"uri", kUri}, {"languageId", "xml"}, {"version", version}, {"text", text}}}};
}

json changed(const std::string& text, int version) {
  return {{"textDocument", {{"uri", kUri}, {"version", version}}},
          {"contentChanges", {{{"text", text}}}}};
}

// The position right after the first occurrence of `mark`, in a text of ASCII.
json after(const std::string& text, const std::string& mark) {
  const std::size_t at = text.find(mark) + mark.size();
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  const std::size_t begin = text.rfind('\n', at - 1) + 1;
  return {{"textDocument", {{"uri", kUri}}},
          {"position", {{"line", line}, {"character", at - begin}}}};
}

std::vector<std::string> labels(const json& answer) {
  std::vector<std::string> result;
  for (const json& item : answer.at("result").at("items")) result.push_back(item.at("label"));
  return result;
}

TEST(LanguageServer, PublishesTheFindingsOfAStaticCheckWithTheirRanges) {
  EditorProcess server;
  server.initialize();
  const std::string good = mission_text();
  server.notify("textDocument/didOpen", opened(good));
  EXPECT_EQ(server.findings(kUri, 1), json::array());

  // The same as dive check prints: code, and the value between the quotes.
  const std::string bad = replaced(good, "speed=\"0.4\"", "speed=\"0,4\"");
  server.notify("textDocument/didChange", changed(bad, 2));
  const json findings = server.findings(kUri, 2);
  ASSERT_EQ(findings.size(), 1);
  EXPECT_EQ(findings[0].at("code"), "XSD-VALUE");
  EXPECT_EQ(findings[0].at("severity"), 1);
  EXPECT_THAT(findings[0].at("message").get<std::string>(), HasSubstr("a decimal point"));
  const json begin = after(bad, "speed=\"").at("position");
  EXPECT_EQ(findings[0].at("range").at("start"), begin);
  EXPECT_EQ(findings[0].at("range").at("end"), after(bad, "speed=\"0,4").at("position"));

  // A finding that only a plan makes.
  const std::string blocked = replaced(good, "clearance=\"0.7\"", "clearance=\"9\"");
  server.notify("textDocument/didChange", changed(blocked, 3));
  EXPECT_FALSE(server.findings(kUri, 3).empty());

  server.notify("textDocument/didClose", {{"textDocument", {{"uri", kUri}}}});
  EXPECT_EQ(server.findings(kUri), json::array());
}

TEST(LanguageServer, PublishesNothingOfATextThatHasChanged) {
  EditorProcess server;
  server.initialize();
  const std::string good = mission_text();
  server.notify("textDocument/didOpen", opened(good));
  for (int version = 2; version <= 40; ++version) {
    server.notify("textDocument/didChange",
                  changed(good + std::string(static_cast<std::size_t>(version), '\n'), version));
  }
  int last = 0;
  while (last != 40) {
    const json message = server.receive();
    ASSERT_FALSE(message.is_null());
    if (!message.contains("params")) continue;
    const int version = message.at("params").at("version");
    EXPECT_GT(version, last);
    last = version;
  }
  EXPECT_TRUE(server.ask("shutdown", nullptr).contains("result"));
}

TEST(LanguageServer, ChecksATextThatHasNoFileYet) {
  EditorProcess server;
  server.initialize();
  json params = opened(mission_text());
  params["textDocument"]["uri"] = "untitled:Untitled-1";
  server.notify("textDocument/didOpen", params);
  const json findings = server.findings("untitled:Untitled-1", 1);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].at("code"), "MIS-MAP-NOT-FOUND");
  EXPECT_THAT(findings[0].at("message").get<std::string>(), HasSubstr("save the mission"));
}

TEST(LanguageServer, ShowsTheCertifiedClearanceOfALeg) {
  EditorProcess server;
  server.initialize();
  const std::string text = mission_text();
  server.notify("textDocument/didOpen", opened(text));
  // Answered at once, whatever the plan takes.
  const json early = server.ask("textDocument/hover", after(text, "<goal id=\""));
  EXPECT_TRUE(early.contains("result"));
  (void)server.ask("textDocument/completion", after(text, "<goal id=\""));
  server.notify("textDocument/didChange", changed(text + "\n", 2));
  EXPECT_EQ(server.findings(kUri, 2), json::array());
  const json hover = server.ask("textDocument/hover", after(text, "<goal id=\""));
  const auto words = hover.at("result").at("contents").at("value").get<std::string>();
  EXPECT_THAT(words, HasSubstr("certified clearance"));
  EXPECT_THAT(words, HasSubstr("(required 0.70 m)"));
  EXPECT_THAT(words, HasSubstr(" sigma at "));
  // Not on a leg: what the schema says.
  const json limits = server.ask("textDocument/hover", after(text, "<limits max_de"));
  EXPECT_THAT(limits.at("result").at("contents").at("value").get<std::string>(),
              HasSubstr("a number from 0.5 to 200 (m)"));
}

TEST(LanguageServer, CompletesByTheSchema) {
  EditorProcess server;
  server.initialize();
  const std::string text =
      "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">\n"
      "  <!-- <limits -->\n"
      "  <vehicle model=\"aqua2\" at speed=\"0.4\"/>\n"
      "  <failsafes><leak rung=\"\"/></failsafes>\n"
      "  <states initial=\"a\"><hold id=\"a\"/>\n"
      "    <goal_sequence id=\"g\" timeout=\"5\">\n      <go\n";
  server.notify("textDocument/didOpen", opened(text));
  const auto at = [&](const char* mark) {
    return labels(server.ask("textDocument/completion", after(text, mark)));
  };
  EXPECT_THAT(at("      <go"),
              ::testing::UnorderedElementsAre("replan", "goal", "onentry", "onexit", "transition"));
  const json item =
      server.ask("textDocument/completion", after(text, "      <go")).at("result").at("items")[1];
  EXPECT_EQ(item.at("textEdit").at("newText"), "goal");
  EXPECT_EQ(item.at("textEdit").at("range").at("start").at("character"), 7);
  EXPECT_THAT(at("rung=\""), Contains("abort_and_surface"));
  EXPECT_THAT(at("\"aqua2\" at"), Contains("attitude"));
  EXPECT_THAT(at("\"aqua2\" at"), Not(Contains("model")));
  EXPECT_THAT(at("<failsafes>"), Contains("battery"));
  EXPECT_TRUE(at("<!-- <limits ").empty());
}

TEST(LanguageServer, AnswersWhatIsMalformedAndGoesOn) {
  EditorProcess server;
  const auto code = [](const json& answer) { return answer.at("error").at("code").get<int>(); };
  EXPECT_EQ(code(server.ask("textDocument/hover", json::object())), kNotInitialized);
  server.initialize();
  for (const char* bytes : {
           "Content-Length: many\r\n\r\n",           // no number
           "Content-Length: -5\r\n\r\n",             // negative
           "Content-Type: text/plain\r\n\r\n",       // no length
           "Content-Length: 9\r\n\r\n{\"id\": 7,",   // not JSON
           "Content-Length: 3\r\n\r\n\xff\xfe\xfd",  // not text
       }) {
    server.write(bytes);
    EXPECT_EQ(code(server.receive()), kParseError) << bytes;
  }
  const std::string large(17U << 20U, ' ');
  server.write(fmt::format("Content-Length: {}\r\n\r\n{}", large.size(), large));
  EXPECT_EQ(code(server.receive()), kParseError);
  server.send(json::array({1, 2}));
  EXPECT_EQ(code(server.receive()), kInvalidRequest);
  server.send({{"jsonrpc", "2.0"}, {"id", "x"}, {"method", 5}});
  EXPECT_EQ(code(server.receive()), kInvalidRequest);
  EXPECT_EQ(code(server.ask("textDocument/rename", json::object())), kMethodNotFound);
  EXPECT_EQ(code(server.ask("textDocument/hover", json::object())), kInvalidParams);
  EXPECT_EQ(code(server.ask("textDocument/completion",
                            {{"textDocument", {{"uri", "file:///not/open.xml"}}},
                             {"position", {{"line", 0}, {"character", 0}}}})),
            kInvalidParams);
  // Without an answer: unknown or malformed notifications.
  server.notify("$/setTrace", {{"value", "off"}});
  server.notify("textDocument/didOpen", json::array());
  server.notify("textDocument/didChange", {{"textDocument", {{"uri", 3}}}});
  // Positions outside of the text.
  server.notify("textDocument/didOpen", opened("<mission"));
  for (const auto& [line, character] : {std::pair(0, 900), std::pair(900, 0), std::pair(-3, -7)}) {
    const json answer = server.ask("textDocument/completion",
                                   {{"textDocument", {{"uri", kUri}}},
                                    {"position", {{"line", line}, {"character", character}}}});
    EXPECT_TRUE(answer.contains("result"));
  }
  EXPECT_TRUE(server.ask("shutdown", nullptr).contains("result"));
  EXPECT_EQ(code(server.ask("textDocument/hover", json::object())), kInvalidRequest);
  server.notify("exit", nullptr);
  EXPECT_EQ(server.end(), 0);
}

TEST(LanguageServer, EndsWithoutAShutdownWithStatusOne) {
  EditorProcess vanished;
  vanished.initialize();
  vanished.write("Content-Length: 100\r\n\r\n{");
  EXPECT_EQ(vanished.end(), 1);
  EditorProcess abrupt;
  abrupt.notify("exit", nullptr);
  EXPECT_EQ(abrupt.end(), 1);
}

}  // namespace
}  // namespace dive::mission::testing
