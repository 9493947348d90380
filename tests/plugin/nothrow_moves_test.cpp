// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Labels of noexcept, at compile time: hosts keep these objects in containers, which move them only
// if a move cannot fail.

#include <type_traits>

#include "dynfilter/motion/motion_filter.hpp"
#include "dynfilter/networks/network_segmenter.hpp"
#include "dynfilter/plugin.hpp"
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "dynfilter/workspace.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

template <class Type>
constexpr bool moves_without_failing =
    std::is_nothrow_move_constructible_v<Type>&& std::is_nothrow_move_assignable_v<Type>&&
        std::is_nothrow_destructible_v<Type> &&
    !std::is_copy_constructible_v<Type>;

static_assert(moves_without_failing<AsyncSegmenter>);
static_assert(moves_without_failing<MaskFolderWriter>);
static_assert(moves_without_failing<MaskPropagator>);
static_assert(moves_without_failing<MotionJudge>);
static_assert(moves_without_failing<NetworkSegmenter>);
static_assert(moves_without_failing<Plugin>);

// Values of one frame. Not Instance: OpenCV gives cv::Mat no label.
static_assert(std::is_nothrow_move_constructible_v<FeatureLabels>);
static_assert(std::is_nothrow_move_constructible_v<Segmentation>);
static_assert(std::is_nothrow_move_constructible_v<Workspace>);
static_assert(std::is_nothrow_move_assignable_v<FeatureLabels>);
static_assert(std::is_nothrow_move_assignable_v<Workspace>);

TEST(NothrowMoves, AreCheckedByTheCompiler) { SUCCEED(); }

}  // namespace
}  // namespace dynfilter::testing
