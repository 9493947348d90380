// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

namespace dynfilter::benchmarks {

/// Registers the alternatives to the filter, and ORB extraction, which a tracker pays anyway:
///
///   peer/dilation/...  peer/naive_filter/...  peer/lk_fundamental/scene
///   peer/orb_extraction/scene  filter/<rule>/scene
void register_filter_peers();

}  // namespace dynfilter::benchmarks
