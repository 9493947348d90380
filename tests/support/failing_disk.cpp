// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shared library for LD_PRELOAD: lets the n-th change of a folder fail, as a broken disk would.
// Counts open() for writing, write(), close(), fsync(), rename(), mkdir(), unlink(), rmdir(),
// remove() and unlinkat(), and only calls about files in that folder. A failed write() has written
// half of its bytes; a failed close() has closed the file. Environment variables:
//   FAILING_DISK_FOLDER  the folder
//   FAILING_DISK_AT      number of the call that fails, from 1; 0: none
//   FAILING_DISK_LASTS   if set, all later calls fail too
//   FAILING_DISK_SIGNAL  if set, nothing fails; a signal interrupts that call if it is write()
//   FAILING_DISK_COUNT   file in which the number of calls stands at the end

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

constexpr int max_files = 4096;
std::atomic<int> calls{0};
std::atomic<bool> is_watched[max_files];  // descriptors of files that are written in the folder

template <class Function>
Function* next(Function* /* of this type */, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

bool lies_in_folder(const char* path) {
  const char* const folder = std::getenv("FAILING_DISK_FOLDER");
  return folder != nullptr && path != nullptr &&
         std::strncmp(path, folder, std::strlen(folder)) == 0;
}

/// Returns a path that is relative to an open folder, made absolute.
std::string path_in(int folder, const char* path) {
  if (folder == AT_FDCWD || path[0] == '/') return path;
  char name[4096];
  const std::string link = "/proc/self/fd/" + std::to_string(folder);
  const ssize_t length = readlink(link.c_str(), name, sizeof name);
  return std::string(name, length < 0 ? 0 : static_cast<std::size_t>(length)) + '/' + path;
}

bool is_watched_file(int file) { return file >= 0 && file < max_files && is_watched[file]; }

/// Whether signals interrupt write(), and the disk works.
bool has_signals() { return std::getenv("FAILING_DISK_SIGNAL") != nullptr; }

/// Counts a call and tells whether it is the one to fail or to be interrupted.
bool is_chosen() {
  static const int at = [] {
    const char* const text = std::getenv("FAILING_DISK_AT");
    return text == nullptr ? 0 : std::atoi(text);
  }();
  static const bool lasts = std::getenv("FAILING_DISK_LASTS") != nullptr;
  const int number = ++calls;
  return at > 0 && (number == at || (lasts && number > at));
}

int failure(int code) {
  errno = code;
  return -1;
}

bool writes(int flags) { return (flags & O_ACCMODE) != O_RDONLY; }

/// Counts a call and tells whether it fails.
bool fails() { return is_chosen() && !has_signals(); }

struct Report {
  ~Report() {
    const char* const file = std::getenv("FAILING_DISK_COUNT");
    if (file == nullptr) return;
    if (std::FILE* const report = std::fopen(file, "w")) {
      std::fprintf(report, "%d\n", calls.load());
      std::fclose(report);
    }
  }
} report;

int open_next(const char* name, const char* path, int flags, mode_t mode) {
  const bool counts = writes(flags) && lies_in_folder(path);
  if (counts && fails()) return failure(ENOSPC);
  const int file = next(&::open, name)(path, flags, mode);
  if (file >= 0 && file < max_files) is_watched[file] = counts;
  return file;
}

/// The mode of a call of open(), which has one only if it makes a file.
#define MODE_OF_OPEN(flags)                             \
  mode_t mode = 0;                                      \
  if (((flags)&O_CREAT) != 0) {                         \
    std::va_list arguments;                             \
    va_start(arguments, flags);                         \
    mode = static_cast<mode_t>(va_arg(arguments, int)); \
    va_end(arguments);                                  \
  }

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  MODE_OF_OPEN(flags)
  return open_next("open", path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  MODE_OF_OPEN(flags)
  return open_next("open64", path, flags, mode);
}

ssize_t write(int file, const void* bytes, size_t count) {
  const auto next_write = next(&::write, "write");
  if (is_watched_file(file) && is_chosen()) {
    if (has_signals()) return failure(EINTR);
    if (count > 1) (void)!next_write(file, bytes, count / 2);
    return failure(ENOSPC);
  }
  return next_write(file, bytes, count);
}

int close(int file) {
  const bool is_failing = is_watched_file(file) && fails();
  if (file >= 0 && file < max_files) is_watched[file] = false;
  const int result = next(&::close, "close")(file);
  return is_failing ? failure(EIO) : result;
}

int fsync(int file) {
  return is_watched_file(file) && fails() ? failure(EIO) : next(&::fsync, "fsync")(file);
}

int rename(const char* from, const char* to) noexcept {
  return (lies_in_folder(from) || lies_in_folder(to)) && fails()
             ? failure(EIO)
             : next(&::rename, "rename")(from, to);
}

int mkdir(const char* path, mode_t mode) noexcept {
  return lies_in_folder(path) && fails() ? failure(ENOSPC) : next(&::mkdir, "mkdir")(path, mode);
}

int unlink(const char* path) noexcept {
  return lies_in_folder(path) && fails() ? failure(EIO) : next(&::unlink, "unlink")(path);
}

int rmdir(const char* path) noexcept {
  return lies_in_folder(path) && fails() ? failure(EIO) : next(&::rmdir, "rmdir")(path);
}

int remove(const char* path) noexcept {
  return lies_in_folder(path) && fails() ? failure(EIO) : next(&::remove, "remove")(path);
}

int unlinkat(int folder, const char* path, int flags) noexcept {
  return lies_in_folder(path_in(folder, path).c_str()) && fails()
             ? failure(EIO)
             : next(&::unlinkat, "unlinkat")(folder, path, flags);
}
}
