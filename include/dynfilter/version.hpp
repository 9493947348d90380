// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The one place where the version stands; CMakeLists.txt reads it from here.

#ifndef DYNFILTER_VERSION_HPP
#define DYNFILTER_VERSION_HPP

#define DYNFILTER_VERSION_MAJOR 0
#define DYNFILTER_VERSION_MINOR 1
#define DYNFILTER_VERSION_PATCH 0

#endif  // DYNFILTER_VERSION_HPP
