#include "mission/cli/completion.h"

#include <algorithm>

#include <fmt/format.h>

namespace dive::mission {
namespace {

bool takes_folder(const OptionEntry& option) { return option.type == "DIR"; }

bool takes_file(const OptionEntry& option) {
  return option.type == "FILE" || option.type == "PATH" || takes_folder(option);
}

std::vector<std::string> names_of(const CommandEntry& command) {
  std::vector<std::string> names;
  for (const OptionEntry& option : command.options) {
    if (!option.is_positional) names.push_back(option.name);
  }
  return names;
}

std::string joined(const std::vector<std::string>& words, const char* by = " ") {
  return fmt::format("{}", fmt::join(words, by));
}

// --- bash ---

std::string bash_value(const OptionEntry& option) {
  if (!option.choices.empty()) {
    return fmt::format("COMPREPLY=($(compgen -W '{}' -- \"$cur\"))", joined(option.choices));
  }
  if (takes_folder(option)) return "_dive_paths -d";
  if (takes_file(option)) return "_dive_paths -f";
  return ":";  // a number or a text: nothing to offer
}

std::string bash_options(const CommandEntry& command) {
  std::string text;
  for (const OptionEntry& option : command.options) {
    if (option.is_positional || option.type.empty()) continue;
    text +=
        fmt::format("    {}:{}) {}; return ;;\n", command.name, option.name, bash_value(option));
  }
  return text;
}

std::string bash_command(const CommandEntry& command) {
  std::vector<std::string> words = names_of(command);
  bool has_files = false;
  for (const OptionEntry& option : command.options) {
    if (!option.is_positional) continue;
    words.insert(words.end(), option.choices.begin(), option.choices.end());
    has_files |= takes_file(option);
  }
  return fmt::format("    {}) words='{}'; paths={} ;;\n", command.name, joined(words),
                     has_files ? "yes" : "no");
}

// --- zsh ---

// In single quotes, within the brackets and colons of _arguments.
std::string zsh_text(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\'') {
      result += "'\\''";
    } else if (c == '[' || c == ']' || c == ':' || c == '\\') {
      result += '\\';
      result += c;
    } else {
      result += c;
    }
  }
  return result;
}

std::string zsh_value(const OptionEntry& option) {
  const std::string type = option.type.empty() ? option.name : option.type;
  if (!option.choices.empty()) {
    return fmt::format(":{}:({})", zsh_text(type), joined(option.choices));
  }
  if (takes_folder(option)) return fmt::format(":{}:_files -/", zsh_text(type));
  if (takes_file(option)) return fmt::format(":{}:_files", zsh_text(type));
  return fmt::format(":{}: ", zsh_text(type));
}

std::string zsh_option(const OptionEntry& option) {
  if (option.is_positional) {
    return fmt::format("'{}{}'", option.is_list ? "*" : "", zsh_value(option));
  }
  const char* repeats = option.is_list ? "*" : "";
  if (option.type.empty()) {
    return fmt::format("'{}{}[{}]'", repeats, option.name, zsh_text(option.help));
  }
  return fmt::format("'{}{}=[{}]{}'", repeats, option.name, zsh_text(option.help),
                     zsh_value(option));
}

std::string zsh_arguments(const CommandEntry& command) {
  std::vector<std::string> words;
  for (const OptionEntry& option : command.options) words.push_back(zsh_option(option));
  return joined(words, " \\\n        ");
}

}  // namespace

std::string bash_completion(const CommandTable& table) {
  std::vector<std::string> commands;
  for (const CommandEntry& command : table.commands) commands.push_back(command.name);
  std::string text = fmt::format(
      "# bash completion for dive {}\n"
      "_dive_paths() {{\n"
      "  compopt -o filenames 2>/dev/null\n"
      "  mapfile -t COMPREPLY < <(compgen \"$1\" -- \"$cur\")\n"
      "}}\n\n"
      "_dive() {{\n"
      "  local cur prev command= words= paths=no i\n"
      "  cur=${{COMP_WORDS[COMP_CWORD]}}\n"
      "  prev=${{COMP_WORDS[COMP_CWORD-1]}}\n"
      "  COMPREPLY=()\n"
      "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
      "    case ${{COMP_WORDS[i]}} in {}) command=${{COMP_WORDS[i]}}; break ;; esac\n"
      "  done\n"
      "  case $command:$prev in\n",
      table.version, joined(commands, "|"));
  for (const CommandEntry& command : table.commands) text += bash_options(command);
  text += "  esac\n  case $command in\n";
  for (const CommandEntry& command : table.commands) text += bash_command(command);
  text += fmt::format("    *) words='{} {}' ;;\n  esac\n", joined(commands),
                      joined(names_of(table.program)));
  return text +
         "  [[ $paths == yes && $cur != -* ]] && _dive_paths -f\n"
         "  COMPREPLY+=($(compgen -W \"$words\" -- \"$cur\"))\n"
         "}\n"
         "complete -F _dive dive\n";
}

std::string zsh_completion(const CommandTable& table) {
  std::string text = fmt::format(
      "#compdef dive\n# zsh completion for dive {}\n\n"
      "_dive() {{\n"
      "  local curcontext=\"$curcontext\" state line\n"
      "  typeset -A opt_args\n"
      "  _arguments -C \\\n        {} \\\n"
      "        '1:command:->command' '*::argument:->argument'\n"
      "  case $state in\n"
      "  command)\n    local -a commands=(\n",
      table.version, zsh_arguments(table.program));
  for (const CommandEntry& command : table.commands) {
    text += fmt::format("      '{}:{}'\n", command.name, zsh_text(command.sentence));
  }
  text += "    )\n    _describe command commands ;;\n  argument)\n    case $words[1] in\n";
  for (const CommandEntry& command : table.commands) {
    text += fmt::format("    {})\n      _arguments \\\n        {} ;;\n", command.name,
                        zsh_arguments(command));
  }
  return text + "    esac ;;\n  esac\n}\n\n_dive \"$@\"\n";
}

}  // namespace dive::mission
