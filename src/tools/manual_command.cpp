// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "commands.hpp"
#include "dynfilter/version.hpp"
#include "lab/scenes/scene_levels.hpp"

namespace dynfilter::tools {
namespace {

/// Sub-commands that the help shows.
std::vector<const CLI::App*> shown_commands(const CLI::App& program) {
  return program.get_subcommands(
      [](const CLI::App* command) { return !command->get_group().empty(); });
}

/// Options that the help shows: positional ones, or those with dashes.
std::vector<const CLI::Option*> shown_options(const CLI::App& command, bool positional) {
  return command.get_options([positional](const CLI::Option* option) {
    return !option->get_group().empty() && option->get_positional() == positional;
  });
}

/// Writes text so that roff prints it as it is.
std::string roff(const std::string& text) {
  std::string result;
  for (const char character : text) {
    const bool begins_line = result.empty() || result.back() == '\n';
    // At a line's beginning these two would begin a command of roff.
    if (begins_line && (character == '.' || character == '\'')) result += "\\&";
    if (character == '\\') {
      result += "\\e";
    } else {
      if (character == '-') result += '\\';
      result += character;
    }
  }
  return result;
}

void print_option(const CLI::Formatter& formatter, const CLI::Option& option, bool positional) {
  std::cout << ".TP\n\\fB" << roff(formatter.make_option_name(&option, positional)) << "\\fR"
            << roff(formatter.make_option_opts(&option)) << "\n"
            << roff(option.get_description()) << "\n";
}

void print_page(const CLI::App& program) {
  const CLI::Formatter formatter;
  std::cout << ".TH DYNFILTER 1 \"\" \"dynfilter " DYNFILTER_VERSION_STRING
               "\" \"User commands\"\n.ad l\n"
               ".SH NAME\ndynfilter \\- keeps the features of moving objects out of visual SLAM\n"
               ".SH SYNOPSIS\n.B dynfilter\n.I command\n[\\fIoption\\fR ...]\n"
               ".SH DESCRIPTION\n"
               "Runs the filter of the library dynfilter on sequences in the layout of TUM's "
               "RGB-D data set, makes masks and scenes for it, and measures results.\n"
               ".SH COMMANDS\n";
  for (const CLI::App* command : shown_commands(program)) {
    std::cout << ".SS dynfilter " << roff(command->get_name());
    for (const CLI::Option* option : shown_options(*command, true)) {
      std::cout << " " << roff(formatter.make_option_usage(option));
    }
    std::cout << "\n" << roff(command->get_description()) << "\n";
    for (const bool positional : {true, false}) {
      for (const CLI::Option* option : shown_options(*command, positional)) {
        print_option(formatter, *option, positional);
      }
    }
    if (command->get_footer().empty()) continue;
    std::cout << ".PP\n.nf\n" << roff(command->get_footer()) << "\n.fi\n";
  }
  std::cout << ".SH EXIT STATUS\n0 if all went well. Otherwise another number, and a message on "
               "standard error that names what was wrong.\n";
}

/// Prints each command's help as a section of a page in Markdown.
void print_markdown(const CLI::App& program) {
  std::cout << "# The command line\n\n`dynfilter <command> --help` prints these texts, too.\n";
  for (const CLI::App* command : shown_commands(program)) {
    const std::string name = "dynfilter " + command->get_name();
    std::cout << "\n## " << name << "\n\n```\n" << command->help("dynfilter") << "```\n";
  }
}

/// Returns the names of an option, with dashes and spaces between them.
std::string names_of(const CLI::Option& option) {
  std::string names;
  for (const std::string& name : option.get_lnames()) names += " --" + name;
  for (const std::string& name : option.get_snames()) names += " -" + name;
  return names;
}

/// Returns the values that an option takes, with spaces between them: none if they cannot be
/// listed, as numbers. std::nullopt if it takes files, or no value.
std::optional<std::string> values_of(const CLI::Option& option) {
  if (option.get_expected_max() == 0) return std::nullopt;  // it is a flag
  // The type as the help shows it: FLOAT:[0 to 10], TEXT:{labels,colmap}, LEVEL, TEXT.
  const std::string type = option.get_type_name();
  const std::size_t first = type.find('{'), last = type.find('}');
  std::string values;
  if (first != std::string::npos && last != std::string::npos) {
    values = type.substr(first + 1, last - first - 1);
    std::replace(values.begin(), values.end(), ',', ' ');
  } else if (type.find("LEVEL") != std::string::npos) {
    for (const SceneLevel& level : scene_levels()) values += level.name + " ";
  } else if (type == "TEXT") {
    return std::nullopt;
  }
  return values;
}

/// Prints a case of bash for each option of a command that no file name follows.
void print_values(const CLI::App& command) {
  for (const CLI::Option* option : shown_options(command, false)) {
    const std::optional<std::string> values = values_of(*option);
    if (!values) continue;
    std::istringstream names(names_of(*option));
    for (std::string name; names >> name;) {
      std::cout << "    '" << command.get_name() << " " << name << "') values='" << *values
                << "' ;;\n";
    }
  }
}

void print_completion(const CLI::App& program) {
  std::cout << R"(# Completion of dynfilter's commands, options, values and files, for bash.
_dynfilter() {
  local word=${COMP_WORDS[COMP_CWORD]} option=${COMP_WORDS[COMP_CWORD - 1]} words= values=none
  if [[ $word == = ]]; then  # --option=
    word=
  elif [[ $option == = ]]; then  # --option=word
    option=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  case "${COMP_WORDS[1]} $option" in
)";
  for (const CLI::App* command : shown_commands(program)) print_values(*command);
  std::cout << R"(  esac
  if ((COMP_CWORD == 1)); then
    words=')";
  for (const CLI::App* command : shown_commands(program)) std::cout << command->get_name() << " ";
  std::cout << R"(--help --version'
  elif [[ $values != none ]]; then  # after a comma another one of a list
    [[ $word == *,* ]] && local head=${word%,*},
    mapfile -t COMPREPLY < <(compgen -P "${head-}" -W "$values" -- "${word##*,}")
    return
  elif [[ $word == -* ]]; then
    case ${COMP_WORDS[1]} in
)";
  for (const CLI::App* command : shown_commands(program)) {
    std::cout << "      " << command->get_name() << ") words='";
    for (const CLI::Option* option : shown_options(*command, false)) {
      std::cout << names_of(*option);
    }
    std::cout << "' ;;\n";
  }
  std::cout << R"(    esac
  else
    compopt -o filenames 2> /dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
    return
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}
complete -F _dynfilter dynfilter
)";
}

}  // namespace

void add_manual_command(CLI::App& program) {
  // Without a group it is not in the help: it serves packages.
  CLI::App* command =
      program.add_subcommand("manual", "Print this help for other readers")->group("");
  const auto completion = std::make_shared<bool>(false);
  const auto markdown = std::make_shared<bool>(false);
  command->add_flag("--completion", *completion, "the completion for bash, not the manual page");
  command->add_flag("--markdown", *markdown, "a page in Markdown, not the manual page")
      ->excludes("--completion");
  command->callback([&program, completion, markdown] {
    if (*completion) {
      print_completion(program);
    } else if (*markdown) {
      print_markdown(program);
    } else {
      print_page(program);
    }
  });
}

}  // namespace dynfilter::tools
