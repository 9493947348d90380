// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "arrays.hpp"
#include "dynfilter/dense_depth_lbp.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

constexpr Argument a_depth_image{"DepthLbp", "a depth image"};

Array dense(const DepthLbp&, const py::object& depth) {
  const cv::Mat image = matrix_from(depth, Pixels::depth, a_depth_image);
  cv::Mat codes;
  {
    const py::gil_scoped_release unlock;
    codes = dense_depth_lbp(image);
  }
  return Array(array_of(codes, true));
}

py::array_t<std::int16_t> codes_of(const DepthLbp& lbp, const py::object& depth,
                                   const py::object& features) {
  const cv::Mat image = matrix_from(depth, Pixels::depth, a_depth_image);
  const py::array points = array_from(features);
  std::vector<std::optional<std::uint8_t>> codes;
  lbp.codes(image, features_from(points, "DepthLbp"), codes);
  py::array_t<std::int16_t> result(static_cast<py::ssize_t>(codes.size()));
  std::int16_t* const values = result.mutable_data();
  for (std::size_t i = 0; i < codes.size(); ++i) values[i] = codes[i] ? *codes[i] : -1;
  return result;
}

}  // namespace

void bind_depth_lbp(py::module_& module) {
  py::class_<DepthLbp>(
      module, "DepthLbp",
      R"(Local binary pattern of a depth image, D-LBP (paper section 3.2, Figure 2). Bit k of a
pixel's code is 1 if neighbour k, clockwise from the top-left one, is farther away than the pixel;
equal depth and no depth give 0.

A pixel on the border of the image or without depth has no code. Depth is uint16 or float32; 0,
negative, NaN and infinite mean "no depth". Codes only compare depths, so the unit does not
matter.)")
      .def(py::init<>())
      .def("dense", &dense, py::arg("depth"),
           R"(Computes the codes of the whole image: uint8, H x W, 0 where a pixel has no code. The
interpreter's lock is released meanwhile.)")
      .def("codes", &codes_of, py::arg("depth"), py::arg("features"),
           "Computes the codes of features, N x 2 float32: int16, N, -1 where one has none.")
      .def(
          "code",
          [](const DepthLbp& lbp, const py::object& depth, const cv::Point& pixel) {
            return lbp.code(matrix_from(depth, Pixels::depth, a_depth_image), pixel);
          },
          py::arg("depth"), py::arg("pixel"),
          "Returns the code of one pixel (x, y), or None if it has none.")
      .def("__repr__", [](const py::object& self) { return type_name(self) + "()"; })
      .def(py::pickle([](const DepthLbp&) { return py::tuple(); },
                      [](const py::tuple&) { return DepthLbp(); }));
}

}  // namespace dynfilter::python
