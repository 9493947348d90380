// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <string>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "dynfilter/version.hpp"
#include "io/file_error.hpp"
#include "progress_bar.hpp"

namespace dynfilter::tools {
namespace {

/// Refuses an empty value of any option of a sub-command, as of a shell variable that is not set,
/// and whole numbers in another notation.
void refuse_odd_values(CLI::App& program) {
  const CLI::Validator something(
      [](std::string& text) -> std::string {
        return text.empty() ? "got an empty value; leave the option out, or name something" : "";
      },
      "");
  const CLI::Validator decimal(
      [](std::string& text) -> std::string {
        return text.size() > 1 && text[0] == '0' ? "got " + text + "; want no 0 before a number"
                                                 : "";
      },
      "");
  for (CLI::App* command : program.get_subcommands({})) {
    for (CLI::Option* option : command->get_options()) {
      option->check(something);
      const bool is_whole = option->get_type_name().find("INT") != std::string::npos;
      if (is_whole) option->check(decimal);  // C++ takes 010 for 8
    }
  }
}

int parse_and_run(int argc, char** argv) {
  CLI::App program("Keeps the features of moving objects out of visual SLAM.", "dynfilter");
  program.set_version_flag("--version", DYNFILTER_VERSION_STRING);
  program.require_subcommand(1);
  add_synth_command(program);
  add_run_command(program);
  add_masks_command(program);
  add_sync_command(program);
  add_doctor_command(program);
  add_eval_command(program);
  add_ablate_command(program);
  refuse_odd_values(program);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error);
  }
  return 0;
}

}  // namespace

int run_program(int argc, char** argv) {
  int exit_code = 1;
  try {
    exit_code = parse_and_run(argc, argv);
  } catch (const Interrupted& interruption) {
    std::fprintf(stderr, "%s\n", interruption.what());
    std::raise(interruption.signal);  // ends the program as the caller expects of this signal
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "error: there is not enough memory\n");
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string what = error.path1().string() + ": " + error.code().message();
    std::fprintf(stderr, "error: %s\n", detail::shown(what).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
  }
  if (!std::cout.flush() || std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    std::fprintf(stderr, "error: standard output: cannot be written\n");
    return 1;
  }
  return exit_code;
}

}  // namespace dynfilter::tools
