// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "commands.hpp"

int main(int argc, char** argv) { return dynfilter::tools::run_program(argc, argv); }
