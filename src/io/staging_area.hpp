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
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/hidden_names.hpp"
#include "io/regular_file.hpp"

namespace dynfilter::detail {

/// Returns the file system of a file; 0 if there is no such file.
inline dev_t device_of(const std::filesystem::path& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_dev : 0;
}

/// Lists the files in a folder, at any depth: sorted names relative to the folder.
inline std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_directory()) files.push_back(entry.path().lexically_relative(folder));
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Lists the files below a folder without the hidden files of writers.
inline std::vector<std::filesystem::path> visible_files_below(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files = files_below(folder);
  files.erase(std::remove_if(files.begin(), files.end(),
                             [](const auto& file) { return is_hidden_name(file.filename()); }),
              files.end());
  return files;
}

/// Tells whether a name is that of a file below a folder: neither absolute nor with "..".
inline bool stays_below(const std::filesystem::path& name) {
  return !name.empty() && !name.is_absolute() &&
         std::find(name.begin(), name.end(), "..") == name.end();
}

/// Tells whether the parent folder (existing or not) of a file below a folder is neither a link nor
/// on another file system.
inline bool has_own_parent(const std::filesystem::path& folder, const std::filesystem::path& name) {
  namespace fs = std::filesystem;
  for (fs::path part = name.parent_path(); !part.empty(); part = part.parent_path()) {
    const fs::file_status status = fs::symlink_status(folder / part);
    if (!fs::exists(status)) continue;
    if (!fs::is_directory(status) || device_of(folder / part) != device_of(folder)) return false;
  }
  return true;
}

/// Removes the folders of these files if they are empty.
inline void remove_empty_folders(const std::filesystem::path& folder,
                                 const std::vector<std::filesystem::path>& files) {
  std::error_code not_empty;
  for (const std::filesystem::path& file : files) {
    for (auto part = file.parent_path(); !part.empty(); part = part.parent_path()) {
      std::filesystem::remove(folder / part, not_empty);
    }
  }
}

/// Owns the hidden folder `.dynfilter-<writer>-<pid>` with new/, old/ and a lock that ends with the
/// process.
class StagingArea {
 public:
  /// The contents of an exchange's mark.
  struct Exchange {
    std::string writer;
    std::string area;                          ///< name of the hidden folder
    std::vector<std::filesystem::path> files;  ///< the new ones
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
    try {
      for (const std::filesystem::path& file : files) {
        std::filesystem::create_directories((folder_ / file).parent_path());
      }
      write_mark(files);
      for (const std::filesystem::path& file : old_files) take(file);
      for (const std::filesystem::path& file : files) {
        std::filesystem::rename(new_files_ / file, folder_ / file);
      }
    } catch (...) {
      undo(folder_, {writer_, area_.filename().string(), files});
      throw;
    }
    remove_mark(folder_);
    made_.clear();
    remove_empty_folders(folder_, old_files);
  }

  /// Undoes an interrupted exchange. Throws std::runtime_error if it was another writer's, or if a
  /// process is still working on it.
  static void recover(const std::filesystem::path& folder, const std::string& writer) {
    if (!std::filesystem::exists(folder / commit_mark_name)) return;
    const Exchange exchange = marked(folder);
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
    undo(folder, exchange);
  }

  /// Reads the mark. Throws std::runtime_error that names one which is not a regular file.
  static Exchange marked(const std::filesystem::path& folder) {
    require_regular_file(folder / commit_mark_name);
    Exchange exchange;
    std::ifstream mark(folder / commit_mark_name);
    std::getline(mark, exchange.writer);
    std::getline(mark, exchange.area);
    for (std::string file; std::getline(mark, file);) exchange.files.emplace_back(file);
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

  static void undo(const std::filesystem::path& folder, const Exchange& exchange) {
    const std::filesystem::path area = folder / exchange.area;
    for (const std::filesystem::path& file : exchange.files) {
      const bool was_moved = !std::filesystem::exists(area / "new" / file);
      if (!was_moved || !std::filesystem::exists(folder / file)) continue;
      std::filesystem::rename(folder / file, area / "new" / file);
    }
    for (const std::filesystem::path& file : files_below(area / "old")) {
      std::filesystem::create_directories((folder / file).parent_path());
      std::filesystem::rename(area / "old" / file, folder / file);
    }
    remove_empty_folders(folder, exchange.files);
    remove_mark(folder);
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

  void write_mark(const std::vector<std::filesystem::path>& files) const {
    std::string text = writer_ + '\n' + area_.filename().string() + '\n';
    for (const std::filesystem::path& file : files) text += file.generic_string() + '\n';
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

  void take(const std::filesystem::path& file) const {
    if (!std::filesystem::exists(std::filesystem::symlink_status(folder_ / file))) return;
    std::filesystem::create_directories((area_ / "old" / file).parent_path());
    std::filesystem::rename(folder_ / file, area_ / "old" / file);
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
