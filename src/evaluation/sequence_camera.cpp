// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/sequence_camera.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "io/camera_keys.hpp"
#include "io/file_error.hpp"
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

SequenceCamera read_camera(const std::filesystem::path& path) {
  if (!detail::exists(path)) {
    if (const std::optional<SequenceCamera> known = known_camera(path.string())) return *known;
  }
  const detail::YamlFile file(path);
  if (file.keys().empty()) file.refuse("holds no keys such as Camera.fx");
  const std::string prefix = detail::camera_prefix(file);
  const std::string factor = detail::depth_factor_key(file);
  for (const std::string& key :
       {prefix + "fx", prefix + "fy", prefix + "cx", prefix + "cy", factor}) {
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
    require(read(key) > 0, key, "a number above 0");
  }
  require(camera.frames_per_second >= 0, "Camera.fps", "a number of at least 0");
  require(std::abs(camera.depth_offset_s) <= max_depth_offset_s, "dynfilter.depth_offset_s",
          "a number within ±10");
  return camera;
}

}  // namespace dynfilter
