// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/plugin.hpp"
#include "dynfilter/plugin.hpp"  // twice is as good as once

#if __cplusplus != 201103L
#error "the plugin's target asks its consumers for another standard than theirs"
#endif
