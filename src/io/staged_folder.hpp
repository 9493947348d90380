// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Folders of results that appear whole or not at all, and never replace files that dynfilter did
// not write. A writer called `run` uses these hidden names in its folder:
//   .dynfilter-run.txt       the files that it wrote, with sizes and hashes: it may replace these
//   .dynfilter-run-<pid>/    the files that it is writing; removed at its end
//   .dynfilter-commit        present while the new files replace the earlier ones
// A process may be killed at any moment. The next writer of that name restores the earlier files
// and removes the unfinished ones.

#ifndef DYNFILTER_SRC_IO_STAGED_FOLDER_HPP
#define DYNFILTER_SRC_IO_STAGED_FOLDER_HPP

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/fingerprint.hpp"
#include "io/staging_area.hpp"
#include "io/text_table.hpp"

namespace dynfilter::detail {

/// Throws std::runtime_error for a folder that mixes earlier and new results, because a writer was
/// stopped there or is working there now.
inline void require_whole(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder / commit_mark_name, ignored)) return;
  throw_file_error(folder, "holds an incomplete result: dynfilter " +
                               StagingArea::marked(folder).writer +
                               " was stopped while it replaced files there; run it again");
}

/// Formats a row of a writer's list.
inline std::string manifest_row(const Fingerprint& fingerprint, const std::filesystem::path& name) {
  return fingerprint.text() + '/' + name.generic_string();
}

/// Returns the first line of a writer's list, a comment.
inline std::string manifest_title(const std::string& writer) {
  return "# What dynfilter " + writer + " wrote here and may replace: size/hash/name";
}

/// Knows the files that an earlier writer of this name wrote into a folder, by their contents.
class EarlierFiles {
 public:
  EarlierFiles(std::filesystem::path folder, std::string writer)
      : folder_(std::move(folder)), writer_(std::move(writer)) {
    const std::filesystem::path file = folder_ / manifest_name(writer_);
    if (!std::filesystem::exists(std::filesystem::symlink_status(file))) return;
    require_list(file);
    for (TableReader rows(file, '/'); rows.next();) {
      // Version 0.1 listed no hashes; what it wrote counts as somebody else's.
      if (rows.columns() < 2 || !parse_hash(rows.text(1))) {
        files_.clear();
        return;
      }
      add_row(rows);
    }
  }

  /// Returns the listed files. Each has one fingerprint, or one a state if it was written in steps.
  const std::map<std::filesystem::path, std::vector<Fingerprint>>& files() const { return files_; }

  /// Tells whether the file is unchanged since it was written and really lies in this folder.
  bool holds(const std::filesystem::path& name) const {
    std::error_code failure;
    if (files_.count(name) == 0 || !has_own_parent(folder_, name) ||
        !std::filesystem::is_regular_file(
            std::filesystem::symlink_status(folder_ / name, failure))) {
      return false;
    }
    return lists(name, fingerprint_of_file(folder_ / name));
  }

  /// Tells whether a file of this name was written with these bytes.
  bool lists(const std::filesystem::path& name, const Fingerprint& bytes) const {
    const auto found = files_.find(name);
    return found != files_.end() &&
           std::find(found->second.begin(), found->second.end(), bytes) != found->second.end();
  }

  /// Throws std::runtime_error that names a file in the way of `names`: one that somebody else
  /// wrote or changed, or, unless `overwrite`, any file. A name that ends in a slash means a
  /// folder.
  void require_room(const std::vector<std::filesystem::path>& names, bool overwrite) const {
    for (const std::filesystem::path& name : names) require_room_for(name, overwrite);
    for (const auto& [name, written] : files_) require_room_for(name, overwrite);
  }

 private:
  /// Throws std::runtime_error for what has the list's name and is none. An empty file is one.
  void require_list(const std::filesystem::path& file) const {
    const std::string beginning = "# What dynfilter " + writer_ + " wrote here";
    std::string line;
    if (std::filesystem::is_regular_file(std::filesystem::symlink_status(file))) {
      std::getline(std::ifstream(file), line);
      if (line.empty() || line.rfind(beginning, 0) == 0) return;
    }
    throw_file_error(file, "is no list of what dynfilter " + writer_ + " wrote; move it away");
  }

  void add_row(const TableReader& rows) {
    namespace fs = std::filesystem;
    // "<size>/<hash>/<name>": the name may have slashes too.
    fs::path name;
    for (std::size_t k = 2; k < rows.columns(); ++k) name /= rows.text(k);
    const double size = rows.number(0, "size");
    if (!stays_below(name) || size < 0) rows.fail("want size/hash/name");
    files_[name].push_back({static_cast<std::uintmax_t>(size), *parse_hash(rows.text(1))});
  }

  void require_room_for(const std::filesystem::path& name, bool overwrite) const {
    const auto refuse = [&](const std::string& what) {
      throw_file_error(folder_, "holds " + name.string() + what);
    };
    if (!has_own_parent(folder_, name)) {
      throw_file_error(folder_ / name.parent_path(),
                       "is no folder of " + folder_.string() + " itself; name another folder");
    }
    if (!name.has_filename()) return;
    if (!std::filesystem::exists(std::filesystem::symlink_status(folder_ / name))) return;
    if (!overwrite) refuse(" already; name another folder, or overwrite it (--overwrite)");
    if (!holds(name)) {
      refuse(", which no earlier dynfilter " + writer_ +
             " wrote in this form; name another folder, or move it away");
    }
  }

  std::filesystem::path folder_;
  std::string writer_;
  std::map<std::filesystem::path, std::vector<Fingerprint>> files_;
};

/// Refuses to undo an exchange that was interrupted if that would cost a file which somebody
/// changed or put there since. Throws std::runtime_error that names the file.
inline void require_unchanged(const std::filesystem::path& folder,
                              const StagingArea::Exchange& exchange) {
  namespace fs = std::filesystem;
  const fs::path area = folder / exchange.area;
  const auto is_there = [](const fs::path& file) { return fs::exists(fs::symlink_status(file)); };
  const auto refuse = [&](const fs::path& file) {
    throw_file_error(folder, "holds an incomplete result of dynfilter " + exchange.writer +
                                 ", and " + file.string() +
                                 " was put there or changed since; move that file away");
  };
  const fs::path list = manifest_name(exchange.writer);  // moved into place after all other files
  const EarlierFiles written(is_there(area / "new" / list) ? area / "new" : folder,
                             exchange.writer);
  std::vector<fs::path> moved;
  for (const fs::path& file : exchange.files) {
    if (is_there(area / "new" / file) || !is_there(folder / file)) continue;
    const bool is_regular = fs::is_regular_file(fs::symlink_status(folder / file));
    const bool is_ours =
        is_regular && (file == list || written.lists(file, fingerprint_of_file(folder / file)));
    if (!is_ours) refuse(file);
    moved.push_back(file);
  }
  for (const fs::path& file : files_below(area / "old")) {
    const bool is_new = std::find(moved.begin(), moved.end(), file) != moved.end();
    if (!is_new && is_there(folder / file)) refuse(file);
  }
}

/// Collects a writer's files aside, inside their folder, and moves them into place all together. If
/// that never happens, the folder stays unchanged.
class StagedFolder {
 public:
  /// Makes the folder if needed. Throws std::runtime_error and changes nothing if existing files
  /// are in the way of `names` (see EarlierFiles::require_room) or another process is writing there
  /// under the same name.
  StagedFolder(const std::filesystem::path& folder, std::string writer,
               std::vector<std::filesystem::path> names, bool overwrite)
      : folder_(std::filesystem::weakly_canonical(std::filesystem::absolute(folder))),
        writer_(std::move(writer)),
        names_(std::move(names)),
        overwrite_(overwrite) {
    require_room();
    area_ = StagingArea(folder_, writer_);
  }

  /// Throws what the constructor throws, but makes nothing. Restores files that a stopped writer
  /// had moved away.
  static void check(const std::filesystem::path& folder, const std::string& writer,
                    const std::vector<std::filesystem::path>& names, bool overwrite) {
    const auto full_path = std::filesystem::weakly_canonical(std::filesystem::absolute(folder));
    if (const auto exchange = StagingArea::interrupted(full_path, writer)) {
      require_unchanged(full_path, *exchange);
      StagingArea::undo(full_path, *exchange);
    }
    EarlierFiles(full_path, writer).require_room(names, overwrite);
  }

  /// Returns the folder to write the files to, under their final names.
  const std::filesystem::path& path() const { return area_.new_files(); }

  /// Replaces an earlier writer's files by the new ones. Without the files `keys`, no reader
  /// accepts the others as results: they are removed first and added last. Skips other writers'
  /// hidden files. Throws std::runtime_error and restores the folder.
  void commit(const std::vector<std::filesystem::path>& keys = {}) {
    require_room();
    std::vector<std::filesystem::path> files = visible_files_below(path());
    const EarlierFiles earlier(folder_, writer_);
    earlier.require_room(files, overwrite_);
    const auto is_key = [&](const std::filesystem::path& file) {
      return std::find(keys.begin(), keys.end(), file) != keys.end();
    };
    std::stable_partition(files.begin(), files.end(), [&](const auto& f) { return !is_key(f); });
    write_manifest(files);
    files.push_back(manifest_name(writer_));

    std::vector<std::filesystem::path> old_files = {manifest_name(writer_)};
    for (const auto& [name, written] : earlier.files()) old_files.push_back(name);
    std::stable_partition(old_files.begin(), old_files.end(), is_key);
    area_.swap(old_files, files);
  }

 private:
  void require_room() const { check(folder_, writer_, names_, overwrite_); }

  void write_manifest(const std::vector<std::filesystem::path>& files) const {
    TableWriter manifest(path() / manifest_name(writer_));
    manifest.line(manifest_title(writer_));
    for (const std::filesystem::path& file : files) {
      manifest.line(manifest_row(fingerprint_of_file(path() / file), file));
    }
    manifest.close();
  }

  std::filesystem::path folder_;
  std::string writer_;
  std::vector<std::filesystem::path> names_;
  bool overwrite_;
  StagingArea area_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_STAGED_FOLDER_HPP
