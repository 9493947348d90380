// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/sequence_camera.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/detail/number_text.hpp"
#include "io/camera_keys.hpp"
#include "io/file_error.hpp"
#include "io/json_members.hpp"
#include "io/yaml_file.hpp"

namespace dynfilter {

std::optional<SequenceCamera> known_camera(const std::string& name) {
  // As the authors of the data sets publish them.
  const auto camera = [](double fx, double fy, double cx, double cy, double k1 = 0, double k2 = 0,
                         double p1 = 0, double p2 = 0, double k3 = 0) {
    return SequenceCamera{{fx, fy, cx, cy, k1, k2, p1, p2, k3}, {640, 480}, 30, 5000, 0};
  };
  if (name == "tum1") {
    return camera(517.306408, 516.469215, 318.643040, 255.313989,  //
                  0.262383, -0.953104, -0.005358, 0.002628, 1.163314);
  }
  if (name == "tum2") {
    return camera(520.908620, 521.007327, 325.141442, 249.701764,  //
                  0.231222, -0.784899, -0.003257, -0.000105, 0.917205);
  }
  if (name == "tum3") return camera(535.4, 539.2, 320.1, 247.6);
  if (name == "bonn") {
    return camera(542.822841, 542.576870, 315.593520, 237.756098,  //
                  0.039903, -0.099343, -0.000730, -0.000144);
  }
  return {};
}

namespace {

/// Reads the camera of Open3D's recordings, a matrix by columns, or of NeRF's transforms.json.
SequenceCamera read_json_camera(const std::filesystem::path& path) {
  detail::require_regular_file(path);
  std::ifstream stream(path, std::ios::binary);
  const auto members = detail::json_members({std::istreambuf_iterator<char>(stream), {}});
  const auto text = [&](const std::string& name) {
    const auto found = members.find('"' + name + '"');
    return found == members.end() ? std::string() : found->second;
  };
  const auto number = [&](const char* name) {
    const double value = detail::parse_number(text(name)).value_or(0);
    const bool is_usual = value == 0 || (std::abs(value) > 1e-12 && std::abs(value) < 1e6);
    if (is_usual && (text(name).empty() || detail::parse_number(text(name)))) return value;
    detail::throw_file_error(path, std::string(name) + ": got " + text(name) + "; want a number");
  };
  if (text("camera_model").find("FISHEYE") != std::string::npos) {
    detail::throw_file_error(path, "camera_model: got " + text("camera_model") +
                                       "; want a pinhole camera: undistort the images");
  }
  SequenceCamera camera{{number("fl_x"), number("fl_y"), number("cx"), number("cy"), number("k1"),
                         number("k2"), number("p1"), number("p2"), number("k3")},
                        {static_cast<int>(number("w") + number("width")),
                         static_cast<int>(number("h") + number("height"))},
                        0,
                        number("depth_scale") > 0 ? number("depth_scale") : 1000,
                        0};
  const std::string matrix = text("intrinsic_matrix");
  std::vector<double> m;
  for (std::size_t begin = 1; begin < matrix.size() && m.size() < 9;) {
    const std::size_t end = std::min(matrix.find_first_of(",]", begin), matrix.size());
    m.push_back(detail::parse_number(matrix.substr(begin, end - begin)).value_or(0));
    begin = end + 1;
  }
  if (m.size() == 9) camera.fx = m[0], camera.fy = m[4], camera.cx = m[6], camera.cy = m[7];
  if (camera.fy == 0) camera.fy = camera.fx;
  if (!(camera.fx > 0 && camera.fy > 0 && camera.cx > 0 && camera.cy > 0)) {
    detail::throw_file_error(path,
                             "has neither intrinsic_matrix, as Open3D's, nor fl_x, cx and cy, as "
                             "NeRF's, at its top; write camera.yaml, or name a camera (--camera)");
  }
  if (camera.image_size.empty()) camera.image_size = {};
  return camera;
}

}  // namespace

SequenceCamera read_camera(const std::filesystem::path& path) {
  if (!detail::exists(path)) {
    if (const std::optional<SequenceCamera> known = known_camera(path.string())) return *known;
  }
  if (path.extension() == ".json") return read_json_camera(path);
  const detail::YamlFile file(path);
  if (file.keys().empty()) file.refuse("holds no keys such as Camera.fx");
  const std::string prefix = detail::camera_prefix(file);
  const std::string factor = detail::depth_factor_key(file);
  for (const std::string& key : {prefix + "fx", prefix + "fy", prefix + "cx", prefix + "cy"}) {
    if (!file.has(key)) file.refuse(key + " is missing");
  }
  const auto read = [&](const std::string& key) { return file.number(key).value_or(0); };
  const auto read_pixels = [&](const char* key) {
    const double value = read(key);
    if (value >= 0 && value == std::floor(value) && value <= std::numeric_limits<int>::max()) {
      return static_cast<int>(value);
    }
    file.refuse(key, file.shown(key), "a whole number of pixels");
  };
  SequenceCamera camera{detail::read_lens(file), {}, 0, 0, 0};
  camera.image_size = {read_pixels("Camera.width"), read_pixels("Camera.height")};
  if (camera.image_size.empty()) camera.image_size = {};  // one side alone says nothing
  camera.frames_per_second = read("Camera.fps");
  camera.depth_units_per_metre = read(factor);
  camera.depth_offset_s = read("dynfilter.depth_offset_s");
  const auto require = [&](bool is_right, const std::string& key, const char* want) {
    if (!is_right) file.refuse(key, file.shown(key), want);
  };
  for (const std::string& key : {prefix + "fx", prefix + "fy", factor}) {
    require(read(key) > 0 || !file.has(key), key, "a number above 0");
  }
  require(camera.frames_per_second >= 0, "Camera.fps", "a number of at least 0");
  require(std::abs(camera.depth_offset_s) <= max_depth_offset_s, "dynfilter.depth_offset_s",
          "a number within ±10");
  return camera;
}

}  // namespace dynfilter
