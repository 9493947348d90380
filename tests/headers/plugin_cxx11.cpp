// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/plugin.hpp"
#include "dynfilter/plugin.hpp"  // a second include has no effect

#if __cplusplus != 201103L
#error "the plugin's target asks its consumers for another standard than theirs"
#endif
