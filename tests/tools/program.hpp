// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Runs the program dynfilter and reads its output.

#pragma once

#include <sys/wait.h>
#include <unistd.h>
#include <wordexp.h>

#include <csignal>
#include <cstdio>

#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include "support/test.hpp"
#include "tools/commands.hpp"

namespace dynfilter::testing {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code;
  std::string printed;

  bool mentions(const std::string& text) const { return printed.find(text) != std::string::npos; }
};

/// Reads what is printed into a pipe, until its writers end.
inline std::string text_from(std::FILE* pipe) {
  std::string text;
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) text += buffer.data();
  return text;
}

inline Outcome run_in_shell(const std::string& command) {
  std::FILE* pipe = popen(("{ " + command + "; } 2>&1").c_str(), "r");
  if (pipe == nullptr) return {-1, {}};
  const std::string printed = text_from(pipe);
  return {pclose(pipe) == 0 ? 0 : 1, printed};
}

/// OpenCV starts no thread in this process, see below.
inline const bool is_serial = (cv::setNumThreads(1), true);

/// Runs the program in a copy of this process, which has loaded the libraries: that takes the
/// program longer than most of the tests' work. Stops it after a while as a failure.
inline Outcome run(const std::string& arguments) {
  constexpr unsigned int seconds = 600;  // a busy machine needs more than a minute
  const auto others = fs::directory_iterator("/proc/self/task");
  wordexp_t words;
  // A copy has none of the other threads, and they may hold locks.
  if (std::distance(begin(others), end(others)) > 1 ||
      wordexp(("dynfilter " + arguments).c_str(), &words, WRDE_NOCMD) != 0) {
    return run_in_shell("timeout " + std::to_string(seconds) + " '" DYNFILTER_PROGRAM "' " +
                        arguments);
  }
  int ends[2];
  if (pipe(ends) != 0) return {-1, {}};
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    alarm(seconds);
    cv::setNumThreads(-1);
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    close(ends[1]);
    std::_Exit(tools::run_program(static_cast<int>(words.we_wordc), words.we_wordv));
  }
  close(ends[1]);
  std::FILE* reading = fdopen(ends[0], "r");
  const std::string printed = text_from(reading);
  std::fclose(reading);
  wordfree(&words);
  int status = -1;
  waitpid(child, &status, 0);
  return {status == 0 ? 0 : 1, printed};
}

/// Runs the program, which must do its work.
inline Outcome succeed(const std::string& arguments) {
  Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.exit_code, 0) << arguments << '\n' << outcome.printed;
  return outcome;
}

inline void expect_mentions(const Outcome& outcome, const std::string& text) {
  EXPECT_TRUE(outcome.mentions(text)) << "not said: " << text << '\n' << outcome.printed;
}

/// Runs the program, which must fail and say `text`.
inline void expect_refused(const std::string& arguments, const std::string& text) {
  const Outcome outcome = run(arguments);
  EXPECT_NE(outcome.exit_code, 0) << arguments;
  expect_mentions(outcome, text);
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

/// Started program, whose output goes to a file.
class Started {
 public:
  Started(const std::string& arguments, const fs::path& printed) : printed_(printed) {
    const std::string command =
        "exec '" DYNFILTER_PROGRAM "' " + arguments + " >" + quoted(printed) + " 2>&1";
    child_ = fork();
    if (child_ == 0) {
      std::signal(SIGINT, SIG_DFL);
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
  }

  void send(int signal) const { kill(child_, signal); }

  bool has_ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(child_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
           info.si_pid != 0;
  }

  /// Waits for the end; returns the status of waitpid.
  int wait() const {
    int status = 0;
    waitpid(child_, &status, 0);
    return status;
  }

  std::string printed() const { return file_text(printed_); }

 private:
  fs::path printed_;
  pid_t child_ = -1;
};

}  // namespace dynfilter::testing
