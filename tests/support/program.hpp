// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Runs the program dynfilter in a shell and reads its output.

#ifndef DYNFILTER_TESTS_SUPPORT_PROGRAM_HPP
#define DYNFILTER_TESTS_SUPPORT_PROGRAM_HPP

#include <array>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace dynfilter::testing {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code;
  std::string printed;

  bool mentions(const std::string& text) const { return printed.find(text) != std::string::npos; }
};

inline Outcome run_in_shell(const std::string& command) {
  Outcome outcome{-1, {}};
  std::FILE* pipe = popen(("{ " + command + "; } 2>&1").c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr)
    outcome.printed += buffer.data();
  outcome.exit_code = pclose(pipe) == 0 ? 0 : 1;
  return outcome;
}

inline Outcome run(const std::string& arguments) {
  return run_in_shell("'" DYNFILTER_PROGRAM "' " + arguments);
}

/// Runs the program and stops it after that many seconds as a failure, so that it cannot hang the
/// tests.
inline Outcome run_at_most(int seconds, const std::string& arguments) {
  return run_in_shell("timeout " + std::to_string(seconds) + " '" DYNFILTER_PROGRAM "' " +
                      arguments);
}

inline std::string quoted(const fs::path& path) { return "'" + path.string() + "'"; }

/// Rows of a CSV file, header first.
inline std::vector<std::vector<std::string>> read_csv(const fs::path& path) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::vector<std::string> cells;
    std::istringstream stream(line + ",");
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    rows.push_back(cells);
  }
  return rows;
}

/// Sum of a column of frames.csv.
inline std::size_t sum_of(const std::vector<std::vector<std::string>>& rows,
                          const std::string& name) {
  std::size_t column = 0;
  while (rows.at(0).at(column) != name) ++column;
  std::size_t sum = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) sum += std::stoul(rows[i].at(column));
  return sum;
}

inline nlohmann::json read_json(const fs::path& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_PROGRAM_HPP
