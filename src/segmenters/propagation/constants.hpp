// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_PROPAGATION_CONSTANTS_HPP
#define DYNFILTER_SRC_SEGMENTERS_PROPAGATION_CONSTANTS_HPP

#include <cstddef>

/// Constants of MaskPropagator, chosen by the overlap of moved masks with true ones.
namespace dynfilter::detail::propagation {

/// Width to which images are reduced before points are tracked, about.
constexpr int work_width_px = 320;
/// Spacing of tracked points in the reduced image, on and around the known instances: one point per
/// square of this side. Elsewhere the squares are twice as wide, for instances not yet reported.
constexpr int point_spacing_px = 8;
/// Largest forward-backward error of a point, pixels of the reduced image: a point counts if
/// tracking it backwards returns it to within this distance.
constexpr double max_forward_backward_px = 1.5;
/// Standard deviation of the Gaussian by which a point's motion spreads to the pixels around it,
/// pixels at a width of 640. Small: limbs move independently; large: an instance moves as one
/// piece.
constexpr double field_sigma_px = 14;
/// Width of a mask's edge, pixels at a width of 640. Points on the edge are ignored if they move as
/// the background beside it does: they would stretch the mask behind the object.
constexpr double edge_px = 8;
/// Smallest number of points on an instance to move it by their flow.
constexpr std::size_t min_points = 3;
/// Smallest overlap, intersection over union, of the boxes of a new and a known instance that are
/// the same.
constexpr double min_iou = 0.25;

}  // namespace dynfilter::detail::propagation

#endif  // DYNFILTER_SRC_SEGMENTERS_PROPAGATION_CONSTANTS_HPP
