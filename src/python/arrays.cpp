// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "arrays.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::python {
namespace {

/// Allocator of matrices that view an array. It allocates nothing: it holds the array until the
/// last copy of the matrix is gone.
class ArrayHolder final : public cv::MatAllocator {
 public:
  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, std::size_t* step,
                         cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    return cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, flags, usage);
  }

  bool allocate(cv::UMatData* data, cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    return cv::Mat::getStdAllocator()->allocate(data, flags, usage);
  }

  void deallocate(cv::UMatData* data) const override {
    if (data == nullptr) return;
    if (Py_IsInitialized() != 0) {  // else the array went with the interpreter
      const py::gil_scoped_acquire lock;
      Py_DECREF(static_cast<PyObject*>(data->userdata));
    }
    delete data;
  }

  /// Makes the matrix, a header without data yet, the keeper of an array.
  void hold(cv::Mat& matrix, const py::array& array) const {
    auto data = std::make_unique<cv::UMatData>(this);
    data->data = data->origdata = matrix.data;
    data->size = static_cast<std::size_t>(matrix.rows) * matrix.step[0];
    data->refcount = 1;
    data->userdata = array.inc_ref().ptr();
    matrix.u = data.release();
  }
};

const ArrayHolder& array_holder() {
  static const ArrayHolder* const holder = new ArrayHolder();  // matrices may outlive main
  return *holder;
}

const char* wanted(Pixels kind) {
  switch (kind) {
    case Pixels::image:
      return "uint8, H x W, or H x W x 3 or 4 (blue, green, red, alpha)";
    case Pixels::depth:
      return "uint16 with metres_per_unit, or float32 in metres, H x W";
    case Pixels::mask:
      return "bool or uint8, H x W";
  }
  return "";
}

/// Tells whether an array holds numbers of this kind and size, in the machine's order of bytes.
bool has_type(const py::array& array, char kind, py::ssize_t bytes) {
  const py::dtype type = array.dtype();
  return type.kind() == kind && type.itemsize() == bytes && type.attr("isnative").cast<bool>();
}

/// Returns the matrix type of one channel, or -1 for arrays of another kind.
int channel_type(const py::array& array, Pixels kind) {
  if (kind == Pixels::depth) {
    return has_type(array, 'u', 2) ? CV_16U : has_type(array, 'f', 4) ? CV_32F : -1;
  }
  const bool is_bool = kind == Pixels::mask && has_type(array, 'b', 1);
  return is_bool || has_type(array, 'u', 1) ? CV_8U : -1;
}

bool is_aligned(const py::array& array) {
  return (array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) != 0;
}

[[noreturn]] void refuse(const py::array& array, const Argument& argument,
                         const std::string& want) {
  detail::throw_misuse(argument.component,
                       detail::concatenate(argument.name, " of ", description(array)), want);
}

/// Refuses an array whose numbers lie elsewhere in memory than they must.
[[noreturn]] void refuse_strides(const py::array& array, const Argument& argument,
                                 const char* want) {
  const std::string strides = py::str(array.attr("strides"));
  refuse(array, argument,
         detail::concatenate(
             want, ", as numpy.ascontiguousarray makes them (strides here: ", strides, ")"));
}

}  // namespace

py::array array_from(const py::object& object) {
  if (py::isinstance<py::array>(object)) return py::reinterpret_borrow<py::array>(object);
  return py::module_::import("numpy").attr("asarray")(object);
}

std::string description(const py::array& array) {
  std::string text = py::str(array.dtype());
  text += ", shape " + std::string(py::str(array.attr("shape")));
  return text;
}

cv::Mat matrix_from(const py::object& object, Pixels kind, const Argument& argument) {
  if (object.is_none()) return {};
  const py::array array = array_from(object);
  const int depth = channel_type(array, kind);
  const py::ssize_t dims = array.ndim();
  const bool has_channels = kind == Pixels::image && dims == 3;
  if (depth < 0 || (dims != 2 && !has_channels)) refuse(array, argument, wanted(kind));
  const py::ssize_t channels = has_channels ? array.shape(2) : 1;
  const py::ssize_t rows = array.shape(0), columns = array.shape(1);
  if (channels != 1 && channels != 3 && channels != 4) refuse(array, argument, wanted(kind));
  if (rows > std::numeric_limits<int>::max() || columns > std::numeric_limits<int>::max()) {
    refuse(array, argument, "sides of at most 2^31 - 1 pixels");
  }
  if (rows == 0 || columns == 0) return {};

  const py::ssize_t value = array.itemsize(), pixel = channels * value;
  const bool is_row_dense =
      (columns == 1 || array.strides(1) == pixel) && (channels == 1 || array.strides(2) == value);
  const py::ssize_t step = rows == 1 ? columns * pixel : array.strides(0);
  if (!is_row_dense || step < columns * pixel || step % value != 0 || !is_aligned(array)) {
    refuse_strides(array, argument, "rows of neighbouring pixels");
  }
  // Only read: FrameView and Segmentation say so.
  cv::Mat matrix(static_cast<int>(rows), static_cast<int>(columns),
                 CV_MAKETYPE(depth, static_cast<int>(channels)), const_cast<void*>(array.data()),
                 static_cast<std::size_t>(step));
  array_holder().hold(matrix, array);
  return matrix;
}

std::optional<py::array> array_of(const cv::Mat& matrix, bool is_writeable) {
  if (matrix.empty()) return {};
  std::string type = matrix.depth() == CV_8U    ? "u1"
                     : matrix.depth() == CV_16U ? "u2"
                     : matrix.depth() == CV_32F ? "f4"
                                                : "";
  if (type.empty()) {
    throw std::runtime_error("dynfilter: a matrix of type " + detail::type_name(matrix) +
                             " has no array");
  }
  if (matrix.u != nullptr && matrix.u->currAllocator == &array_holder()) {
    const auto array =
        py::reinterpret_borrow<py::array>(static_cast<PyObject*>(matrix.u->userdata));
    const bool is_whole = matrix.data == array.data() && array.shape(0) == matrix.rows &&
                          array.shape(1) == matrix.cols;
    if (is_whole) return array;
    if (array.dtype().kind() == 'b') type = "?";
  }
  std::vector<py::ssize_t> shape = {matrix.rows, matrix.cols};
  std::vector<py::ssize_t> strides = {static_cast<py::ssize_t>(matrix.step[0]),
                                      static_cast<py::ssize_t>(matrix.elemSize())};
  if (matrix.channels() > 1) {
    shape.push_back(matrix.channels());
    strides.push_back(static_cast<py::ssize_t>(matrix.elemSize1()));
  }
  const py::capsule owner(new cv::Mat(matrix),
                          [](void* pixels) { delete static_cast<cv::Mat*>(pixels); });
  py::array array(py::dtype(type), shape, strides, matrix.data, owner);
  if (!is_writeable) array.attr("setflags")(py::arg("write") = false);
  return array;
}

FeaturesView features_from(const py::array& points, const char* component) {
  const Argument argument{component, "features"};
  if (points.size() == 0 && points.ndim() == 1) return {};  // OpenCV's points of no keypoints
  const bool is_opencv = points.ndim() == 3 && points.shape(1) == 1;
  const py::ssize_t last = points.ndim() - 1;
  const bool has_points = (points.ndim() == 2 || is_opencv) && points.shape(last) == 2;
  if (!has_points || !has_type(points, 'f', 4)) {
    refuse(points, argument, "float32, N x 2 (x, y in pixels)");
  }
  const py::ssize_t count = points.shape(0);
  if (count == 0) return {};
  const py::ssize_t stride = count == 1 ? points.itemsize() * 2 : points.strides(0);
  if (points.strides(last) != points.itemsize() || stride < 0 || !is_aligned(points)) {
    refuse_strides(points, argument, "x and y side by side");
  }
  return {static_cast<const cv::Point2f*>(points.data()), static_cast<std::size_t>(count),
          static_cast<std::size_t>(stride)};
}

py::array_t<double, py::array::c_style> numbers_from(const py::object& object,
                                                     const Argument& argument) {
  const py::array array = array_from(object);
  if (std::string("biuf").find(array.dtype().kind()) == std::string::npos) {
    refuse(array, argument, "numbers");
  }
  return py::array_t<double, py::array::c_style | py::array::forcecast>(array);
}

}  // namespace dynfilter::python
