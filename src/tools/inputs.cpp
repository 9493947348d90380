// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "inputs.hpp"

#include <sys/stat.h>

#include "io/file_error.hpp"
#include "io/staged_folder.hpp"

namespace dynfilter::tools {
namespace {

namespace fs = std::filesystem;

/// Returns the identity of a file and follows links; {0, 0} if there is no such file.
std::pair<dev_t, ino_t> id_of(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {0, 0};
  return {status.st_dev, status.st_ino};
}

}  // namespace

void Inputs::add(const fs::path& path) {
  if (!path.empty() && fs::exists(path)) ids_.insert(id_of(path));
}

void Inputs::add_folder(const fs::path& folder) {
  if (!fs::is_directory(folder)) return;
  add(folder);
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory()) add(entry.path());
  }
}

bool Inputs::contains(const fs::path& path) const {
  const auto id = id_of(path);
  return id != std::make_pair(dev_t{0}, ino_t{0}) && ids_.count(id) > 0;
}

void require_harmless(const Inputs& inputs, const fs::path& out, const std::string& writer,
                      const std::vector<fs::path>& names, bool overwrite) {
  std::set<fs::path> folders = {""};
  for (const fs::path& name : names) folders.insert(name.parent_path());
  for (const fs::path& folder : folders) {
    const fs::path written = folder.empty() ? out : out / folder;
    if (!inputs.contains(written)) continue;
    detail::throw_file_error(written,
                             "is read from, and would be written to; name another --out folder");
  }
  detail::StagedFolder::check(out, writer, names, overwrite);
  const detail::EarlierFiles earlier(out, writer);
  for (const auto& [name, written] : earlier.files()) {
    if (!inputs.contains(out / name)) continue;
    detail::throw_file_error(out / name,
                             "is read, and would be replaced; name another --out folder");
  }
}

}  // namespace dynfilter::tools
