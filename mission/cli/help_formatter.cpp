#include "mission/cli/help_formatter.h"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

namespace dive::mission {

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return fmt::format("  {:<9} {}\n", command->get_name(),
                     parts_of(command->get_description()).sentence);
}

// CLI11 would repeat the words that a value may be, which the help of each option explains.
std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  if (option->get_type_size() == 0) return "";
  std::string text = " " + type_of(*option);
  if (option->get_expected_max() == CLI::detail::expected_max_vector_size) text += " ...";
  if (option->get_required()) text += " REQUIRED";
  return text;
}

CommandDescription parts_of(const std::string& description) {
  CommandDescription parts;
  const std::size_t end = description.rfind("\n\n");
  const std::size_t begin = end == std::string::npos ? 0 : end + 2;
  parts.text = description.substr(begin);
  std::ranges::replace(parts.text, '\n', ' ');
  parts.sentence = parts.text.substr(0, parts.text.find(". "));
  if (parts.sentence.ends_with('.')) parts.sentence.pop_back();
  if (begin == 0) return parts;
  std::istringstream lines(description.substr(0, end));
  std::string line;
  std::getline(lines, line);  // "Examples:"
  while (std::getline(lines, line)) {
    parts.examples.push_back(line.substr(std::min(line.find_first_not_of(' '), line.size())));
  }
  return parts;
}

std::string type_of(const CLI::Option& option) {
  if (option.get_type_size() == 0) return "";
  const std::string name = option.get_type_name();
  return name.substr(0, name.find(':'));  // what follows describes its checks
}

std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string name = option.get_type_name();
  const std::size_t begin = name.find(":{");
  if (begin == std::string::npos) return {};
  std::istringstream words(name.substr(begin + 2, name.find('}', begin) - begin - 2));
  std::vector<std::string> choices;
  for (std::string word; std::getline(words, word, ',');) choices.push_back(word);
  return choices;
}

}  // namespace dive::mission
