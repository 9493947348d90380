// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <filesystem>
#include <memory>

#include "frame_source.hpp"

namespace dynfilter::tools {

/// Tells whether a name is a film's or a camera's: a file, or a number without such a folder.
bool is_film(const std::filesystem::path& name);

/// Opens a film, or a camera for 300 frames. Frames have no depth and must be read in order; those
/// of a film are named by their times, frame number / frames a second. Throws std::runtime_error
/// that says what to do with what OpenCV cannot read.
std::unique_ptr<FrameSource> open_film(const SceneSpec& spec);

}  // namespace dynfilter::tools
