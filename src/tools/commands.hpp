// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The sub-commands of the program; each declares its options and its action.

#ifndef DYNFILTER_SRC_TOOLS_COMMANDS_HPP
#define DYNFILTER_SRC_TOOLS_COMMANDS_HPP

#include <CLI/CLI.hpp>

namespace dynfilter::tools {

void add_synth_command(CLI::App& program);
void add_run_command(CLI::App& program);
void add_masks_command(CLI::App& program);
void add_sync_command(CLI::App& program);
void add_doctor_command(CLI::App& program);
void add_eval_command(CLI::App& program);
void add_ablate_command(CLI::App& program);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_COMMANDS_HPP
