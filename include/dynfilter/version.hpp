// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

/// @file
/// Version of the library, stated only here; CMakeLists.txt reads it.

#pragma once

/// @{
/// Part of the version, major.minor.patch.
#define DYNFILTER_VERSION_MAJOR 0
#define DYNFILTER_VERSION_MINOR 3
#define DYNFILTER_VERSION_PATCH 0
/// @}

/// The whole version as text.
#define DYNFILTER_VERSION_STRING "0.3.0"
