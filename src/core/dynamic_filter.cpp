// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/dynamic_filter.hpp"

namespace dynfilter {

template class Pipeline<MaskCuller, Compensator, FeatureFloor>;

}  // namespace dynfilter
