// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The hidden folder of StagedFolder: it tells who is writing, and exchanges files with the folder
// around it. The next writer undoes an exchange that a signal interrupted.

#ifndef DYNFILTER_SRC_IO_STAGING_AREA_HPP
#define DYNFILTER_SRC_IO_STAGING_AREA_HPP

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/folder_contents.hpp"
#include "io/hidden_names.hpp"
#include "io/regular_file.hpp"

namespace dynfilter::detail {

/// Owns the hidden folder `.dynfilter-<writer>-<pid>` with new/, old/ and a lock that ends with the
/// process.
class StagingArea {
 public:
  /// The contents of an exchange's mark.
  struct Exchange {
    std::string writer;
    std::string area;                            ///< name of the hidden folder
    std::vector<std::filesystem::path> files;    ///< the new ones
    std::vector<std::filesystem::path> folders;  ///< made for them, inner ones first
  };

  StagingArea() = default;

  /// Makes the folder and the one around it, and removes the areas of dead writers of that name.
  /// Throws std::runtime_error if such a writer is still working, or if something cannot be made.
  StagingArea(const std::filesystem::path& folder, const std::string& writer)
      : folder_(folder), writer_(writer) {
    try {
      make_folder();
      make_area();
      remove_leftovers();
    } catch (...) {
      leave();
      throw;
    }
  }

  StagingArea(StagingArea&& other) noexcept { *this = std::move(other); }
  StagingArea& operator=(StagingArea&& other) noexcept {
    std::swap(folder_, other.folder_);
    std::swap(writer_, other.writer_);
    std::swap(area_, other.area_);
    std::swap(new_files_, other.new_files_);
    std::swap(made_, other.made_);
    std::swap(lock_, other.lock_);
    return *this;
  }
  ~StagingArea() { leave(); }

  const std::filesystem::path& new_files() const { return new_files_; }

  /// Moves those of `old_files` that exist out of the folder, then moves `files` from new/ into it,
  /// in their order. Throws std::runtime_error and restores the folder.
  void swap(const std::vector<std::filesystem::path>& old_files,
            const std::vector<std::filesystem::path>& files) {
    const Exchange exchange = {writer_, area_.filename().string(), files,
                               missing_folders(folder_, files)};
    std::vector<std::filesystem::path> taken;
    try {
      for (const std::filesystem::path& file : files) {
        std::filesystem::create_directories((folder_ / file).parent_path());
      }
      write_mark(exchange);
      for (const std::filesystem::path& file : old_files) {
        if (take(file)) taken.push_back(file);
      }
      for (const std::filesystem::path& file : files) {
        std::filesystem::rename(new_files_ / file, folder_ / file);
      }
    } catch (...) {
      undo(folder_, exchange);
      throw;
    }
    remove_mark(folder_);
    made_.clear();
    remove_empty_folders(folder_, taken);
  }

  /// Returns an interrupted exchange that is to be undone, if there is one. Throws
  /// std::runtime_error if it was another writer's, or if a process is still working on it.
  static std::optional<Exchange> interrupted(const std::filesystem::path& folder,
                                             const std::string& writer) {
    if (!std::filesystem::exists(folder / commit_mark_name)) return {};
    Exchange exchange = marked(folder);
    if (exchange.writer != writer) {
      throw_file_error(folder, "holds an incomplete result: dynfilter " + exchange.writer +
                                   " was stopped while it replaced files there; run that again, "
                                   "or name another folder");
    }
    require_own(folder, exchange);
    require_no_writer(folder / exchange.area, writer);
    if (!std::filesystem::is_directory(folder / exchange.area)) {
      throw_file_error(folder, "holds an incomplete result of dynfilter " + writer + ", and " +
                                   exchange.area + " with the other files is gone; move all away");
    }
    return exchange;
  }

  /// Takes the new files of an exchange away again, and restores the earlier ones, over whatever
  /// has their names by now.
  static void undo(const std::filesystem::path& folder, const Exchange& exchange) {
    const std::filesystem::path area = folder / exchange.area;
    for (const std::filesystem::path& file : exchange.files) {
      const bool was_moved = !std::filesystem::exists(area / "new" / file);
      if (!was_moved || !std::filesystem::exists(folder / file)) continue;
      std::filesystem::create_directories((area / "new" / file).parent_path());
      std::filesystem::rename(folder / file, area / "new" / file);
    }
    for (const std::filesystem::path& file : files_below(area / "old")) {
      std::filesystem::create_directories((folder / file).parent_path());
      std::filesystem::rename(area / "old" / file, folder / file);
    }
    for (const std::filesystem::path& made : exchange.folders) {
      std::error_code not_empty;
      std::filesystem::remove(folder / made, not_empty);
    }
    remove_mark(folder);
  }

  /// Reads the mark. Throws std::runtime_error that names one which is not a regular file.
  static Exchange marked(const std::filesystem::path& folder) {
    require_regular_file(folder / commit_mark_name);
    Exchange exchange;
    std::ifstream mark(folder / commit_mark_name);
    std::getline(mark, exchange.writer);
    std::getline(mark, exchange.area);
    for (std::string name; std::getline(mark, name);) {
      const bool is_folder = !name.empty() && name.back() == '/';
      if (is_folder) {
        name.pop_back();
        exchange.folders.emplace_back(name);
      } else {
        exchange.files.emplace_back(name);
      }
    }
    if (mark.bad()) throw_file_error(folder / commit_mark_name, "cannot be read to its end");
    return exchange;
  }

 private:
  /// Throws std::runtime_error if the mark names anything but files below the folder and a hidden
  /// folder of the writer in it: then somebody else wrote the mark.
  static void require_own(const std::filesystem::path& folder, const Exchange& exchange) {
    namespace fs = std::filesystem;
    const std::string prefix = hidden_prefix + exchange.writer + '-';
    const fs::path area = exchange.area;
    const fs::file_status status = fs::symlink_status(folder / area);
    bool is_own = exchange.area.rfind(prefix, 0) == 0 && area.filename() == area &&
                  (fs::is_directory(status) || !fs::exists(status));
    std::vector<fs::path> names = exchange.files;
    if (is_own) {
      const std::vector<fs::path> old_files = files_below(folder / area / "old");
      names.insert(names.end(), old_files.begin(), old_files.end());
    }
    for (const fs::path& made : exchange.folders) names.push_back(made / "file");
    for (const fs::path& name : names) {
      is_own = is_own && stays_below(name) && has_own_parent(folder, name) &&
               has_own_parent(folder, area / "new" / name) &&
               has_own_parent(folder, area / "old" / name);
    }
    if (is_own) return;
    throw_file_error(folder / commit_mark_name,
                     "names files that dynfilter cannot have moved there; move it away");
  }

  static std::string owner_text(const std::string& writer) {
    return "dynfilter " + writer + " is writing here\n";
  }

  /// Counts the entries of a folder; 0 if it cannot be listed.
  static std::ptrdiff_t entries_in(const std::filesystem::path& folder) {
    std::error_code ignored;
    const std::filesystem::directory_iterator entries(folder, ignored);
    return std::distance(begin(entries), end(entries));
  }

  /// Tells whether the hidden folder belongs to a writer of this name: by the file inside it, or,
  /// if the writer ended before that file was whole, because the folder holds nothing else.
  static bool is_area_of(const std::filesystem::path& area, const std::string& writer) {
    if (std::filesystem::is_empty(area)) return true;
    const std::filesystem::path file = area / "owner";
    if (!std::filesystem::is_regular_file(std::filesystem::symlink_status(file))) return false;
    std::ifstream owner(file);
    std::string text;
    std::getline(owner, text);
    const std::string whole = owner_text(writer);
    if (text + '\n' == whole) return true;
    const bool is_part =
        whole.rfind(text, 0) == 0 && text.size() == std::filesystem::file_size(file);
    return is_part && entries_in(area) == 1;
  }

  /// Tells whether a process holds the lock; true if that cannot be found out.
  static bool is_held(const std::filesystem::path& area) {
    const int file = ::open((area / "owner").c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) return errno != ENOENT;
    const bool is_free = ::flock(file, LOCK_EX | LOCK_NB) == 0;
    ::close(file);
    return !is_free;
  }

  static void require_no_writer(const std::filesystem::path& area, const std::string& writer) {
    if (!is_held(area)) return;
    throw_file_error(area.parent_path(), "another dynfilter " + writer +
                                             " is writing there: " + area.filename().string());
  }

  void make_folder() {
    namespace fs = std::filesystem;
    std::error_code failure;
    for (auto part = folder_; !fs::exists(part, failure); part = part.parent_path()) {
      if (failure) throw_file_error(folder_, "cannot be made: " + failure.message());
      if (fs::is_symlink(fs::symlink_status(part))) {
        throw_file_error(part, "is a link to a folder that is not there; make that folder first");
      }
      made_.push_back(part);
    }
    std::filesystem::create_directories(folder_, failure);
    if (!failure && !std::filesystem::is_directory(folder_)) {
      failure = std::make_error_code(std::errc::not_a_directory);
    }
    if (failure) throw_file_error(folder_, "cannot be made: " + failure.message());
  }

  void make_area() {
    const std::string name = hidden_prefix + writer_ + '-' + std::to_string(::getpid());
    std::error_code failure;
    for (int number = 0; area_.empty(); ++number) {
      const auto area = folder_ / (number == 0 ? name : name + '-' + std::to_string(number));
      if (std::filesystem::create_directory(area, failure)) area_ = area;
      if (failure) throw_file_error(area, "cannot be made: " + failure.message());
    }
    // A process that finds this file empty must not judge it: the file is locked before the owner
    // is written.
    const std::filesystem::path owner = area_ / "owner";
    lock_ = ::open(owner.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (lock_ < 0) throw_file_error(owner, "cannot be written: " + errno_text());
    ::flock(lock_, LOCK_EX | LOCK_NB);
    const std::string text = owner_text(writer_);
    if (::write(lock_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
      throw_file_error(owner, "cannot be written: " + errno_text());
    }
    new_files_ = area_ / "new";
    std::filesystem::create_directory(new_files_);
    std::filesystem::create_directory(area_ / "old");
  }

  void remove_leftovers() const {
    const std::string prefix = hidden_prefix + writer_ + '-';
    std::vector<std::filesystem::path> areas;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      const bool has_name = entry.path().filename().string().rfind(prefix, 0) == 0;
      const bool is_folder = std::filesystem::is_directory(entry.symlink_status());
      if (!has_name || entry.path() == area_ || !is_folder) continue;
      if (is_area_of(entry.path(), writer_)) areas.push_back(entry.path());
    }
    for (const std::filesystem::path& area : areas) {
      require_no_writer(area, writer_);
      remove_area(area);
    }
  }

  void write_mark(const Exchange& exchange) const {
    std::string text = exchange.writer + '\n' + exchange.area + '\n';
    for (const std::filesystem::path& file : exchange.files) text += file.generic_string() + '\n';
    for (const std::filesystem::path& made : exchange.folders)
      text += made.generic_string() + "/\n";
    write_file(area_ / "mark", text);
    std::filesystem::rename(area_ / "mark", folder_ / commit_mark_name);
  }

  static void remove_mark(const std::filesystem::path& folder) {
    std::error_code stays;
    std::filesystem::remove(folder / commit_mark_name, stays);
    if (stays) {
      throw_file_error(folder / commit_mark_name,
                       "cannot be removed: " + stays.message() +
                           "; the results beside it count as incomplete, so run it again");
    }
  }

  /// Moves a file to old/. Returns whether there was one.
  bool take(const std::filesystem::path& file) const {
    if (!std::filesystem::exists(std::filesystem::symlink_status(folder_ / file))) return false;
    std::filesystem::create_directories((area_ / "old" / file).parent_path());
    std::filesystem::rename(folder_ / file, area_ / "old" / file);
    return true;
  }

  /// Removes the owner file last, and only if nothing else is left, so that the next writer can
  /// remove what a signal or a broken disk left over.
  static void remove_area(const std::filesystem::path& area) {
    std::error_code failure;
    std::filesystem::directory_iterator entry(area, failure);
    if (failure) return;
    while (!failure && entry != std::filesystem::directory_iterator()) {
      const std::filesystem::path path = entry->path();
      entry.increment(failure);
      std::error_code ignored;
      if (path.filename() != "owner") std::filesystem::remove_all(path, ignored);
    }
    if (entries_in(area) > 1) return;
    std::filesystem::remove(area / "owner", failure);
    std::filesystem::remove(area, failure);
  }

  /// Removes the hidden folder, unless the outer folder needs its contents, and the folders that
  /// were made in vain.
  void leave() noexcept {
    std::error_code ignored;
    try {
      if (!area_.empty() && !std::filesystem::exists(folder_ / commit_mark_name, ignored)) {
        remove_area(area_);
      }
    } catch (const std::exception&) {
      // Out of memory: the next writer removes what is left.
    }
    if (lock_ >= 0) ::close(lock_);
    for (const std::filesystem::path& folder : made_) std::filesystem::remove(folder, ignored);
    area_.clear();
    made_.clear();
    lock_ = -1;
  }

  std::filesystem::path folder_, area_, new_files_;
  std::string writer_;
  std::vector<std::filesystem::path> made_;  // folders that did not exist before, the deepest first
  int lock_ = -1;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_STAGING_AREA_HPP
