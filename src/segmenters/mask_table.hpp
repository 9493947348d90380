// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Names and limits shared by the reader and the writer of mask folders.

#pragma once

namespace dynfilter::detail {

constexpr const char* mask_table_name = "instances.csv";
constexpr const char* mask_table_header = "frame,instance,class_id,score,x,y,width,height";
/// The last column is optional: the time of the image that the masks were made of.
constexpr const char* mask_table_header_with_time =
    "frame,instance,class_id,score,x,y,width,height,mask_time";
constexpr int max_mask_label = 65535;  // the limit of a 16-bit PNG

}  // namespace dynfilter::detail
