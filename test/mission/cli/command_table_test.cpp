// What is made from the one definition of commands and options: every command and option of the
// help is in man pages and completions, suggestions for what is mistyped, --json everywhere. The
// help that these tests read is printed by CLI11, not by the code under test.

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using testing::content_of;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::own_folder;
using testing::Ran;
using testing::run_here;

std::set<std::string> all_matches(const std::string& text, const std::regex& pattern) {
  std::set<std::string> found;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), pattern);
       it != std::sregex_iterator(); ++it) {
    found.insert((*it)[1].str());
  }
  return found;
}

std::set<std::string> commands() {
  const std::string help = run_here("--help").out;
  return all_matches(help.substr(help.find("Subcommands:")), std::regex("\n  ([a-z]+) "));
}

std::set<std::string> options_of(const std::string& command) {
  const std::string help = run_here(command + " --help").out;
  return all_matches(help.substr(help.find("Options:")), std::regex("\n  (?:-h,)?(--[a-z-]+)"));
}

std::string share() {
  EXPECT_EQ(run_here("generate share --force").status, 0);
  return (own_folder() / "share").string();
}

TEST(CommandTable, EveryCommandHasJson) {
  const std::set<std::string> all = commands();
  EXPECT_GE(all.size(), 20U);
  for (const std::string& command : all) {
    if (command == "lsp") continue;  // speaks JSON only
    EXPECT_TRUE(options_of(command).contains("--json")) << command;
  }
}

TEST(CommandTable, EveryCommandAndOptionHasItsPlaceInTheManPages) {
  const std::string man = share() + "/man/man1/";
  const std::string all = content_of(man + "dive.1");
  for (const std::string& command : commands()) {
    EXPECT_THAT(all, HasSubstr("\\fBdive " + command + "\\fR"));
    const std::string page = content_of(man + "dive-" + command + ".1");
    EXPECT_THAT(page, HasSubstr(".SH NAME\ndive\\-" + command + " \\- "));
    for (const std::string& option : options_of(command)) {
      const std::string escaped = std::regex_replace(option, std::regex("-"), "\\-");
      EXPECT_THAT(page, HasSubstr("\\fB" + escaped + "\\fR")) << command;
    }
  }
}

// What bash offers for the last of the words.
std::set<std::string> completed_by_bash(const std::string& share, const std::string& words) {
  const std::string script = fmt::format(
      "source '{}/bash-completion/completions/dive'; COMP_WORDS=({}); "
      "COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _dive; printf '%s\\n' \"${{COMPREPLY[@]}}\"",
      share, words);
  const std::string file = (own_folder() / "try.sh").string();
  std::FILE* out = std::fopen(file.c_str(), "w");
  std::fputs(script.c_str(), out);
  std::fclose(out);
  const std::string command =
      fmt::format("cd '{}' && bash '{}' >bash.txt 2>&1", own_folder().string(), file);
  EXPECT_EQ(std::system(command.c_str()), 0) << content_of(own_folder() / "bash.txt");
  const std::string printed = "\n" + content_of(own_folder() / "bash.txt");
  return all_matches(printed, std::regex("\n([^\n]+)"));
}

TEST(CommandTable, BashOffersEveryCommandAndOption) {
  const std::string files = share();
  const std::set<std::string> offered = completed_by_bash(files, "dive ''");
  for (const std::string& command : commands()) {
    EXPECT_TRUE(offered.contains(command)) << command;
    EXPECT_EQ(completed_by_bash(files, "dive " + command + " --"), options_of(command)) << command;
  }
}

TEST(CommandTable, BashOffersValuesAndFiles) {
  const std::string files = share();
  EXPECT_EQ(completed_by_bash(files, "dive plan --attitude ''"),
            (std::set<std::string>{"free", "flat", "horizontal"}));
  EXPECT_EQ(completed_by_bash(files, "dive import q"), (std::set<std::string>{"qgc"}));
  EXPECT_EQ(completed_by_bash(files, "dive check sha"), (std::set<std::string>{"share"}));
  EXPECT_TRUE(completed_by_bash(files, "dive check --dives ''").empty()) << "a number";
}

TEST(CommandTable, ZshReadsItsCompletionAndFindsEveryOption) {
  const std::string file = share() + "/zsh/vendor-completions/_dive";
  const std::string text = content_of(file);
  EXPECT_THAT(text.substr(0, 13), "#compdef dive");
  for (const std::string& command : commands()) {
    const std::size_t begin = text.find("    " + command + ")\n");
    ASSERT_NE(begin, std::string::npos) << command;
    const std::string part = text.substr(begin, text.find(";;", begin) - begin);
    for (const std::string& option : options_of(command)) {
      const bool is_there = part.find("'" + option + "[") != std::string::npos ||
                            part.find(option + "=[") != std::string::npos;
      EXPECT_TRUE(is_there) << command << " " << option;
    }
  }
  if (std::system("command -v zsh >/dev/null 2>&1") != 0) GTEST_SKIP() << "zsh is not installed";
  EXPECT_EQ(std::system(fmt::format("zsh -n '{}'", file).c_str()), 0);
}

TEST(CommandTable, GenerateIsForPackagesAndOverwritesNothing) {
  EXPECT_THAT(run_here("--help").out, Not(HasSubstr("generate")));
  share();
  const Ran again = run_here("generate share");
  EXPECT_EQ(again.status, 2);
  EXPECT_THAT(again.err, HasSubstr("--force"));
  const Ran unwritable = run_here("generate /dev/null/share");
  EXPECT_EQ(unwritable.status, 2) << unwritable.err;
  const Json files = Json::parse(run_here("generate share --force --json").out).at("files");
  EXPECT_EQ(files.size(), commands().size() + 4);
}

/// A command line with a mistake, and what is said of it.
struct Mistake {
  const char* words;
  const char* answer;
};

TEST(UsageError, SuggestsWhatWasMeant) {
  const Mistake mistakes[] = {
      {"chek m.xml", "there is no command 'chek' (did you mean 'check'?)"},
      {"chek --static m.xml", "there is no command 'chek' (did you mean 'check'?)"},
      {"--verson", "there is no option --verson (did you mean '--version'?)"},
      {"run --sed 3 m.xml", "run has no option --sed (did you mean '--seed'?)"},
      {"run --sed=3 m.xml", "run has no option --sed (did you mean '--seed'?)"},
      {"abort --timout 3", "abort has no option --timout (did you mean '--timeout'?)"},
      {"plan m.xml --attitude fre",
       "--attitude fre: must be one of free, flat, horizontal (did "
       "you mean 'free'?)"},
      {"import qcg f", "FORMAT qcg: must be one of acfr, qgc (did you mean 'qgc'?)"},
      {"new transekt",
       "KIND transekt: must be one of transect, penetration, goals (did you mean "
       "'transect'?)"},
      {"xyzzy", "there is no command 'xyzzy'\n"},
      {"run --frobnicate m.xml", "run has no option --frobnicate\n"},
      {"", "which command?"},
  };
  for (const Mistake& mistake : mistakes) {
    const Ran ran = run_here(mistake.words);
    EXPECT_EQ(ran.status, 2) << mistake.words;
    EXPECT_THAT(ran.err, HasSubstr(mistake.answer)) << mistake.words;
    EXPECT_EQ(ran.out, "") << mistake.words;
  }
}

TEST(Graph, PrintsJson) {
  const std::string mission = "'" DIVE_SOURCE_DIR "/missions/window.xml'";
  const Json printed = Json::parse(run_here("graph --json " + mission).out);
  EXPECT_EQ(printed.at("format"), "dot");
  EXPECT_EQ(printed.at("text").get<std::string>(), run_here("graph " + mission).out);
  const Json written =
      Json::parse(run_here("graph --json --format scxml --output m.scxml --force " + mission).out);
  EXPECT_EQ(written.at("output"), "m.scxml");
  EXPECT_THAT(content_of(own_folder() / "m.scxml"), HasSubstr("<scxml"));
}

TEST(Key, PrintsJson) {
  fs::remove(own_folder() / "dive.key");
  EXPECT_EQ(Json::parse(run_here("key dive.key --json").out).at("key"), "dive.key");
}

class NewMission : public ::testing::TestWithParam<const char*> {};

TEST_P(NewMission, PassesTheCheck) {
  const std::string kind = GetParam();
  const std::string file = "my-" + kind + "_1.xml";
  const Ran made = run_here("new " + kind + " " + file + " --force --json");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(Json::parse(made.out).at("map"), "my-" + kind + "_1.sdf");
  EXPECT_THAT(content_of(own_folder() / file), HasSubstr("id=\"my-" + kind + "_1\""));
  EXPECT_THAT(content_of(own_folder() / file), Not(HasSubstr("@NAME@")));
  const Ran checked = run_here("check --dives 4 --json " + file);
  EXPECT_EQ(checked.status, 0) << checked.err;
  const Json report = Json::parse(checked.out);
  EXPECT_EQ(report.at("dives").at("successes"), 4);
  EXPECT_TRUE(report.at("diagnostics").empty()) << report.at("diagnostics");
}

INSTANTIATE_TEST_SUITE_P(Of, NewMission, ::testing::Values("transect", "penetration", "goals"),
                         [](const auto& each) { return std::string(each.param); });

TEST(NewMissionFile, IsNamedByItsFileAndOverwritesNothing) {
  EXPECT_EQ(run_here("new goals 'my mission.xml'").status, 2);
  EXPECT_EQ(run_here("new goals 1st.xml").status, 2);
  EXPECT_THAT(run_here("new goals survey.txt").err, HasSubstr("name the file ID.xml"));
  for (const char* name : {"2nd", "a.b", "'q\"'", "'a&b'"}) {
    const Ran ran = run_here(fmt::format("new goals {}.xml", name));
    EXPECT_EQ(ran.status, 2) << name;
    EXPECT_THAT(ran.err, HasSubstr("name the file ID.xml")) << name;
  }
  ASSERT_EQ(run_here("new goals --force").status, 0);
  fs::remove(own_folder() / "goals.xml");
  const std::string map = content_of(own_folder() / "goals.sdf");
  const Ran refused = run_here("new transect goals.xml");
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, HasSubstr("goals.sdf"));
  EXPECT_EQ(content_of(own_folder() / "goals.sdf"), map);
  EXPECT_FALSE(fs::exists(own_folder() / "goals.xml")) << "what is refused leaves nothing";
}

}  // namespace
}  // namespace dive::mission
