// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program and its sub-commands; each of these declares its options and its action.

#pragma once

namespace CLI {
class App;
}

namespace dynfilter::tools {

void add_synth_command(CLI::App& program);
void add_run_command(CLI::App& program);
void add_masks_command(CLI::App& program);
void add_sync_command(CLI::App& program);
void add_doctor_command(CLI::App& program);
void add_eval_command(CLI::App& program);
void add_ablate_command(CLI::App& program);

/// Runs the program and returns its exit code. Errors go to standard error.
int run_program(int argc, char** argv);

}  // namespace dynfilter::tools
