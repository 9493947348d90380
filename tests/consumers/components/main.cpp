// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Calls into the compiled components: exit code 0 if they refuse what is not there, and name it.

#include <exception>
#include <string>

#include <dynfilter/datasets/camera.hpp>
#include <dynfilter/dynfilter.hpp>
#include <dynfilter/segmenters/mask_folder_segmenter.hpp>

namespace {

template <typename Action>
bool refuses_by_name(Action action) {
  try {
    action();
  } catch (const std::exception& error) {
    return std::string(error.what()).find("no_such_place") != std::string::npos;
  }
  return false;
}

}  // namespace

int main() {
  const bool segmenters_work =
      refuses_by_name([] { dynfilter::MaskFolderSegmenter("no_such_place"); });
  const bool evaluation_works = refuses_by_name([] { dynfilter::read_camera("no_such_place"); });
  return segmenters_work && evaluation_works ? 0 : 1;
}
