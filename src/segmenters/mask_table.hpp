// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What the reader and the writer of mask folders agree on.

#ifndef DYNFILTER_SRC_SEGMENTERS_MASK_TABLE_HPP
#define DYNFILTER_SRC_SEGMENTERS_MASK_TABLE_HPP

namespace dynfilter::detail {

constexpr const char* mask_table_name = "instances.csv";
constexpr const char* mask_table_header = "frame,instance,class_id,score,x,y,width,height";
constexpr int max_mask_label = 65535;  // of a 16-bit PNG

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_MASK_TABLE_HPP
