// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// NumPy arrays as matrices and features, and matrices as arrays, without copies.

#pragma once

#include <optional>
#include <string>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"

namespace dynfilter::python {

namespace py = pybind11;

/// Kind of a matrix, which says what array it may be: an image is uint8, H x W or H x W x 3 (or 4),
/// a depth image uint16 or float32, a mask bool or uint8, each H x W.
enum class Pixels { image, depth, mask };

/// Place of an argument, for errors: "dynfilter::<component>: got <name> of …".
struct Argument {
  const char* component;
  const char* name;  ///< with its article: "an image"
};

/// Returns an object as an array: itself, or what numpy.asarray makes of it. A tensor on the CPU
/// shares its memory.
py::array array_from(const py::object& object);

/// Returns what an array is, for errors: "float64, shape (480, 640)".
std::string description(const py::array& array);

/// Views an array as a matrix. None is an empty matrix. No pixel is copied: the matrix and its
/// copies keep the array alive, in any thread. Throws std::invalid_argument for another type or
/// shape, for another order of bytes, for pixels of a row that are not neighbours (transposed,
/// Fortran order, every second column, flipped) and for misaligned ones.
cv::Mat matrix_from(const py::object& object, Pixels kind, const Argument& argument);

/// Returns a matrix as an array that shares its pixels and keeps them alive; None for an empty one.
/// A matrix that views a whole array is that array. Others are read-only unless `is_writeable`,
/// because they may share pixels with other matrices.
std::optional<py::array> array_of(const cv::Mat& matrix, bool is_writeable = false);

/// Views an array of N x 2 or N x 1 x 2 points, float32, as features. The rows may have any
/// distance. The view must not outlive the array. Throws std::invalid_argument like matrix_from.
FeaturesView features_from(const py::array& points, const char* component);

/// Returns an object as an array of numbers, in the order of C: a copy unless it is one. Throws
/// std::invalid_argument for what is neither bool, int nor float.
py::array_t<double, py::array::c_style> numbers_from(const py::object& object,
                                                     const Argument& argument);

}  // namespace dynfilter::python
