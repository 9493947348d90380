// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_OBJECTS_BY_PLACE_HPP
#define DYNFILTER_DETAIL_OBJECTS_BY_PLACE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/rectangle_table.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter::detail {

/// The frame's objects, found by where they reach.
class ObjectsByPlace {
 public:
  ObjectsByPlace(const std::vector<ObjectInFrame>& objects, const cv::Size& image,
                 std::vector<RectangleTable>& memory)
      : objects_(objects), reaches_(memory) {
    reaches_.assign(tables_for(objects.size()), RectangleTable(image));
    for (std::size_t k = 0; k < objects.size(); ++k) {
      reaches_[k / in_a_table].add(k % in_a_table, objects[k].reach);
    }
  }

  static std::size_t tables_for(std::size_t objects) {
    return (objects + in_a_table - 1) / in_a_table;
  }

  /// False only where no object reaches, inside the image or not.
  bool may_reach(cv::Point pixel) const {
    std::uint64_t candidates = 0;
    for (const RectangleTable& table : reaches_) candidates |= table.candidates(pixel);
    return candidates != 0;
  }

  /// Whether one of the objects that reach the pixel says so; they are asked in their order, and
  /// those after it are not.
  template <class Predicate>
  bool any_in_reach(cv::Point pixel, const Predicate& predicate) const {
    const ObjectInFrame* in_table = objects_.data();
    for (const RectangleTable& table : reaches_) {
      for (std::uint64_t bits = table.candidates(pixel); bits != 0; bits &= bits - 1) {
        const ObjectInFrame& object = in_table[__builtin_ctzll(bits)];
        if (object.reach.contains(pixel) && predicate(object)) return true;
      }
      in_table += in_a_table;
    }
    return false;
  }

 private:
  static constexpr std::size_t in_a_table = RectangleTable::most_rectangles;

  const std::vector<ObjectInFrame>& objects_;
  std::vector<RectangleTable>& reaches_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_OBJECTS_BY_PLACE_HPP
