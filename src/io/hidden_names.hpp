// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Names of dynfilter's own files in a folder of results, see staged_folder.hpp.

#ifndef DYNFILTER_SRC_IO_HIDDEN_NAMES_HPP
#define DYNFILTER_SRC_IO_HIDDEN_NAMES_HPP

#include <algorithm>
#include <filesystem>
#include <string>

#include "io/file_error.hpp"

namespace dynfilter::detail {

constexpr const char* hidden_prefix = ".dynfilter-";
constexpr const char* commit_mark_name = ".dynfilter-commit";

/// Returns the name of the file that lists what a writer wrote into a folder.
inline std::string manifest_name(const std::string& writer) {
  return hidden_prefix + writer + ".txt";
}

inline bool is_hidden_name(const std::filesystem::path& name) {
  return name.string().rfind(hidden_prefix, 0) == 0;
}

/// Refuses an image whose results would have a hidden name, which no folder of results may hold for
/// anything else. Looks at each part of the name that the results get.
inline void require_shown_name(const std::filesystem::path& image,
                               const std::filesystem::path& name) {
  if (std::none_of(name.begin(), name.end(), is_hidden_name)) return;
  throw_file_error(image, std::string("its results would have a name that begins with ") +
                              hidden_prefix + ", as dynfilter's hidden files have; rename it");
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_HIDDEN_NAMES_HPP
