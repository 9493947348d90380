// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Folders of results, which appear at a writer's end and replace nothing that dynfilter did not
// write. A writer called `run` uses these hidden names in its folder:
//   .dynfilter-run-<pid>-<n>/   the files that it is writing
//   .dynfilter-run.txt          the files that it wrote: the next writer may replace these

#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/process.hpp"

namespace dynfilter::detail {

namespace fs = std::filesystem;

/// Returns the name of the file that lists what a writer wrote into a folder.
inline std::string list_name(const std::string& writer) { return hidden_prefix + writer + ".txt"; }

inline bool is_hidden_name(const fs::path& name) {
  return name.string().rfind(hidden_prefix, 0) == 0;
}

/// Returns the canonical path of a folder that need not exist. Throws std::runtime_error that names
/// a path that cannot be resolved.
inline fs::path canonical_folder(const fs::path& folder) {
  std::error_code failure;
  const fs::path path = fs::weakly_canonical(fs::absolute(folder), failure);
  if (failure) throw_file_error(folder, "cannot be read: " + failure.message());
  return path.has_filename() ? path : path.parent_path();  // "out/" is "out"
}

/// Tells whether a canonical path is that of a folder or lies in it.
inline bool is_within(const fs::path& inner, const fs::path& outer) {
  return *inner.lexically_relative(outer).begin() != "..";
}

/// Throws std::runtime_error if a file of this name would not lie in the folder itself, because
/// one of its folders is a link, or could not be listed.
inline void require_own_place(const fs::path& folder, const fs::path& name) {
  if (has_control(name.string())) throw_file_error(name, "want a name without control characters");
  for (fs::path inner = name.parent_path(); !inner.empty(); inner = inner.parent_path()) {
    const fs::file_status status = fs::symlink_status(folder / inner);
    if (!fs::exists(status) || fs::is_directory(status)) continue;
    throw_file_error(folder / inner,
                     "is no folder of " + folder.string() + " itself; name another folder");
  }
}

/// The files that an earlier writer of this name wrote into a folder and that are still there.
class WrittenFiles {
 public:
  /// `folder` must be canonical. Throws std::runtime_error for a list that is no regular file.
  WrittenFiles(const fs::path& folder, const std::string& writer)
      : folder_(folder), writer_(writer), list_(folder / list_name(writer)) {
    if (!fs::exists(require_writable(list_))) return;
    std::ifstream stream(list_);
    std::string line;
    has_list_ = std::getline(stream, line) && line == title();
    while (has_list_ && std::getline(stream, line)) {
      const fs::path file = folder_ / line;
      const bool is_file = fs::is_regular_file(fs::symlink_status(file));
      const bool is_below = fs::path(line).is_relative() && fs::weakly_canonical(file) == file;
      if (is_file && is_below) names_.insert(line);
    }
  }

  const std::set<fs::path>& names() const { return names_; }

  /// Throws std::runtime_error for a folder that holds files without a list of this writer's, or,
  /// unless `overwrite`, earlier files of this writer.
  void require_room(bool overwrite) const {
    if (!overwrite && !names_.empty()) {
      throw_file_error(
          folder_,
          "holds " + names_.begin()->string() +
              " already; name another folder, or overwrite it (--overwrite, in code overwrite)");
    }
    if (has_list_ || !fs::exists(folder_)) return;
    if (!fs::is_directory(folder_)) throw_file_error(folder_, "is no folder");
    for (fs::recursive_directory_iterator entry(folder_), end; entry != end; ++entry) {
      if (is_hidden_name(entry->path().filename())) {
        entry.disable_recursion_pending();
      } else if (!fs::is_directory(entry->symlink_status())) {
        refuse(entry->path().lexically_relative(folder_));
      }
    }
  }

  /// Throws std::runtime_error if this writer did not write the file that is there, if any.
  void require_room_for(const fs::path& name) const {
    require_own_place(folder_, name);
    if (fs::exists(fs::symlink_status(folder_ / name)) && names_.count(name) == 0) refuse(name);
  }

  void save(const std::set<fs::path>& names) const {
    std::string text = title() + '\n';
    for (const fs::path& name : names) text += name.string() + '\n';
    write_file(list_, text);
  }

 private:
  std::string title() const {
    return "# What dynfilter " + writer_ + " wrote here and may replace: names";
  }

  [[noreturn]] void refuse(const fs::path& name) const {
    throw_file_error(folder_, "holds " + name.string() + ", which no earlier dynfilter " + writer_ +
                                  " wrote; name another folder, or move it away");
  }

  fs::path folder_;
  std::string writer_;
  fs::path list_;
  bool has_list_ = false;
  std::set<fs::path> names_;
};

/// Collects a writer's files aside, inside their folder, and moves them into place at the end. If
/// that never happens, the folder keeps its contents.
class StagedFolder {
 public:
  /// Makes the folder if needed. Throws what WrittenFiles::require_room throws.
  StagedFolder(const fs::path& folder, const std::string& writer, bool overwrite)
      : folder_(canonical_folder(folder)), writer_(writer), overwrite_(overwrite) {
    WrittenFiles(folder_, writer).require_room(overwrite);
    for (fs::path p = folder_; !fs::exists(p); p = p.parent_path()) made_.push_back(p);
    std::error_code failure;
    fs::create_directories(folder_, failure);
    const std::string name = hidden_prefix + writer + '-' + std::to_string(::getpid()) + '-';
    for (int k = 0; !failure && area_.empty(); ++k) {
      const fs::path area = folder_ / (name + std::to_string(k));
      if (fs::create_directory(area, failure)) area_ = area;
    }
    if (failure) throw_file_error(folder_, "cannot be made: " + failure.message());
  }
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;
  ~StagedFolder() {
    if (!home_.is_here()) return;  // the files are those of the parent
    std::error_code ignored;
    fs::remove_all(area_, ignored);
    for (const fs::path& folder : made_) fs::remove(folder, ignored);  // if it is empty
  }

  /// Returns the folder to write the files to, under their final names. Throws std::runtime_error
  /// in a child of fork(), and so does commit.
  const fs::path& path() const {
    if (!home_.is_here()) throw_file_error(folder_, "is being written by the parent process");
    return area_;
  }

  /// Replaces the files of an earlier writer of this name by the new ones. Throws
  /// std::runtime_error that names a file in the way, which stays.
  void commit() {
    path();
    const WrittenFiles earlier(folder_, writer_);
    if (!overwrite_ && !earlier.names().empty()) earlier.require_room(false);
    const std::set<fs::path> files = new_files();
    std::set<fs::path> all = earlier.names();
    for (const fs::path& file : files) {
      earlier.require_room_for(file);
      fs::create_directories((folder_ / file).parent_path());
      all.insert(file);
    }
    earlier.save(all);
    for (const fs::path& file : files) fs::rename(area_ / file, folder_ / file);
    for (const fs::path& file : earlier.names()) {
      if (files.count(file) == 0) remove(file);
    }
    earlier.save(files);
  }

 private:
  /// Lists the files in the hidden folder but the lists of writers in it.
  std::set<fs::path> new_files() const {
    std::set<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(area_)) {
      const fs::path name = entry.path().filename();
      const bool is_list = is_hidden_name(name) && name.extension() == ".txt";
      if (!entry.is_directory() && !is_list) files.insert(entry.path().lexically_relative(area_));
    }
    return files;
  }

  /// Removes a file and the folders that it leaves empty.
  void remove(const fs::path& name) const {
    fs::remove(folder_ / name);
    std::error_code not_empty;
    for (fs::path part = name.parent_path(); !part.empty(); part = part.parent_path()) {
      fs::remove(folder_ / part, not_empty);
    }
  }

  fs::path folder_, area_;
  std::string writer_;
  bool overwrite_;
  HomeProcess home_;
  std::vector<fs::path> made_;  // folders that did not exist before, the deepest first
};

}  // namespace dynfilter::detail
