// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "dynfilter/version.hpp"

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

/// Prints the names of options with dashes, and of shorter forms.
void print_names(const CLI::App& command) {
  for (const CLI::Option* option : shown_options(command, false)) {
    for (const std::string& name : option->get_lnames()) std::cout << " --" << name;
    for (const std::string& name : option->get_snames()) std::cout << " -" << name;
  }
}

void print_completion(const CLI::App& program) {
  std::cout << "# Completion of dynfilter's commands, options and files, for bash.\n"
               "_dynfilter() {\n"
               "  local word=${COMP_WORDS[COMP_CWORD]} words=\n"
               "  if ((COMP_CWORD == 1)); then\n"
               "    words='";
  for (const CLI::App* command : shown_commands(program)) std::cout << command->get_name() << " ";
  std::cout << "--help --version'\n"
               "  elif [[ $word == -* ]]; then\n"
               "    case ${COMP_WORDS[1]} in\n";
  for (const CLI::App* command : shown_commands(program)) {
    std::cout << "      " << command->get_name() << ") words='";
    print_names(*command);
    std::cout << "' ;;\n";
  }
  std::cout << "    esac\n"
               "  else\n"
               "    mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n"
               "    return\n"
               "  fi\n"
               "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")\n"
               "}\n"
               "complete -o filenames -F _dynfilter dynfilter\n";
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
