#include "mission/cli/man_page.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

namespace dive::mission {
namespace {

// Text without macros: a line that begins with a full stop or an apostrophe would be one.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else {
      result += c;
    }
  }
  const bool is_macro = !result.empty() && (result.front() == '.' || result.front() == '\'');
  return is_macro ? "\\&" + result : result;
}

std::string title(const std::string& name, const std::string& version) {
  std::string upper = name;
  std::ranges::transform(upper, upper.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return fmt::format(".TH {} 1 \"\" \"dive {}\" \"dive\"\n", escaped(upper), version);
}

std::string name_section(const std::string& name, const std::string& sentence) {
  return fmt::format(".SH NAME\n{} \\- {}\n", escaped(name), escaped(sentence));
}

std::string text_section(const char* heading, const std::string& text) {
  return fmt::format(".SH {}\n{}\n", heading, escaped(text));
}

std::string examples_section(const std::vector<std::string>& examples) {
  if (examples.empty()) return "";
  std::string text = ".SH EXAMPLES\n.nf\n";
  for (const std::string& line : examples) text += escaped(line) + "\n";
  return text + ".fi\n";
}

std::string option_entry(const OptionEntry& option) {
  std::string head = fmt::format("\\fB{}\\fR", escaped(option.name));
  if (option.is_positional) head = fmt::format("\\fI{}\\fR", escaped(option.name));
  if (!option.is_positional && !option.type.empty()) {
    head += fmt::format(" \\fI{}\\fR", escaped(option.type));
  }
  if (option.is_list) head += " ...";
  std::string help = option.help;
  if (!option.choices.empty() && help.find(option.choices.front()) == std::string::npos) {
    help += fmt::format(" ({})", fmt::join(option.choices, ", "));
  }
  return fmt::format(".TP\n{}\n{}\n", head, escaped(help));
}

std::string options_section(const std::vector<OptionEntry>& options) {
  std::string text = ".SH OPTIONS\n";
  for (const OptionEntry& option : options) {
    if (option.is_positional) text += option_entry(option);
  }
  for (const OptionEntry& option : options) {
    if (!option.is_positional) text += option_entry(option);
  }
  return text;
}

std::string synopsis(const CommandEntry& command) {
  std::string text = fmt::format(".SH SYNOPSIS\n\\fBdive {}\\fR", escaped(command.name));
  for (const OptionEntry& option : command.options) {
    if (!option.is_positional) continue;
    const std::string argument =
        fmt::format("\\fI{}\\fR{}", escaped(option.name), option.is_list ? " ..." : "");
    text += option.is_required ? " " + argument : " [" + argument + "]";
  }
  return text + " [options]\n";
}

constexpr const char* kExitStatus =
    ".SH EXIT STATUS\n"
    ".TP\n0\nsuccess\n"
    ".TP\n1\na negative result: the mission or test failed, the dive was aborted, or the files "
    "differ\n"
    ".TP\n2\nwrong usage, or invalid or unreadable input\n"
    ".TP\n3\nan internal error, or a result that could not be written\n"
    ".TP\n4\nthe dive of the vehicle has not ended (dive run with an LCM URL)\n"
    ".TP\n128 + N\na second signal N ended the process\n";

constexpr const char* kOutput =
    "Results are printed on standard output, progress and errors on standard error. With "
    "\\-\\-json "
    "the result is one JSON object.\n";

constexpr const char* kEnvironment =
    ".SH ENVIRONMENT\n.TP\nNO_COLOR\nIf set and not empty: no colour on a terminal.\n"
    ".TP\nGZ_SIM_RESOURCE_PATH, GAZEBO_MODEL_PATH\nFolders in which meshes of maps may lie.\n";

}  // namespace

std::string man_page(const CommandTable& table) {
  std::string text = title("dive", table.version) + name_section("dive", table.program.sentence);
  text += ".SH SYNOPSIS\n\\fBdive\\fR \\fICOMMAND\\fR [arguments]\n";
  text += text_section("DESCRIPTION", table.program.text) + kOutput;
  text += ".SH COMMANDS\n";
  for (const CommandEntry& command : table.commands) {
    text += fmt::format(".TP\n\\fBdive {}\\fR\n{}. See dive\\-{}(1).\n", escaped(command.name),
                        escaped(command.sentence), escaped(command.name));
  }
  text += options_section(table.program.options) + examples_section(table.program.examples);
  return text + kExitStatus + kEnvironment;
}

std::string man_page(const CommandTable& table, const CommandEntry& command) {
  const std::string name = "dive-" + command.name;
  std::string text = title(name, table.version) + name_section(name, command.sentence);
  text += synopsis(command) + text_section("DESCRIPTION", command.text);
  text += options_section(command.options) + examples_section(command.examples);
  return text + kExitStatus + ".SH SEE ALSO\ndive(1)\n";
}

}  // namespace dive::mission
