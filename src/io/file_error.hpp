// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_IO_FILE_ERROR_HPP
#define DYNFILTER_SRC_IO_FILE_ERROR_HPP

#include <filesystem>
#include <stdexcept>
#include <string>

namespace dynfilter::detail {

/// Throws for a file that is missing, malformed or cannot be written: "<path>: <what is wrong>".
[[noreturn]] inline void throw_file_error(const std::filesystem::path& path,
                                          const std::string& what) {
  throw std::runtime_error(path.string() + ": " + what);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_FILE_ERROR_HPP
