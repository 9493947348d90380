// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/camera.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <locale>
#include <optional>
#include <sstream>
#include <string>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/camera_keys.hpp"
#include "io/file_error.hpp"
#include "io/yaml_file.hpp"

namespace dynfilter {
namespace {

enum class Range : std::uint8_t { finite, positive, not_negative, offset };

/// The numbers of a camera and their keys; first those of its model.
constexpr struct {
  const char *name, *key;
  double CameraParameters::*value;
  Range range;
} numbers[] = {
    {"fx", "Camera.fx", &CameraParameters::fx, Range::positive},
    {"fy", "Camera.fy", &CameraParameters::fy, Range::positive},
    {"cx", "Camera.cx", &CameraParameters::cx, Range::finite},
    {"cy", "Camera.cy", &CameraParameters::cy, Range::finite},
    {"k1", "Camera.k1", &CameraParameters::k1, Range::finite},
    {"k2", "Camera.k2", &CameraParameters::k2, Range::finite},
    {"p1", "Camera.p1", &CameraParameters::p1, Range::finite},
    {"p2", "Camera.p2", &CameraParameters::p2, Range::finite},
    {"k3", "Camera.k3", &CameraParameters::k3, Range::finite},
    {"frames_per_second", "Camera.fps", &CameraParameters::frames_per_second, Range::not_negative},
    {"depth_units_per_metre", "DepthMapFactor", &CameraParameters::depth_units_per_metre,
     Range::positive},
    {"depth_offset_s", "dynfilter.depth_offset_s", &CameraParameters::depth_offset_s,
     Range::offset},
};
constexpr int model_numbers = 9;

/// Returns what the number should be; null if it is right.
const char* wanted(Range range, double value) {
  if (!std::isfinite(value)) return "a finite number";
  if (range == Range::positive && !(value > 0)) return "a number above 0";
  if (range == Range::not_negative && value < 0) return "a number of at least 0";
  if (range == Range::offset && std::abs(value) > max_depth_offset_s) return "a number within ±10";
  return nullptr;
}

/// Formats a number with the fewest digits that give it back exactly, and with a decimal point:
/// ORB-SLAM3 takes a number without one for an integer and stops.
std::string real_text(double value) {
  std::string text;
  for (int digits = 6; digits <= std::numeric_limits<double>::max_digits10; ++digits) {
    std::ostringstream stream;
    stream.exceptions(std::ios::badbit);  // a stream would swallow a failed allocation
    stream.imbue(std::locale::classic());
    stream.precision(digits);
    stream << value;
    text = stream.str();
    if (detail::parse_number(text) == value) break;
  }
  const std::size_t exponent = text.find('e');
  if (text.find('.') == std::string::npos) {
    text.insert(exponent == std::string::npos ? text.size() : exponent, ".0");
  }
  return text;
}

}  // namespace

std::optional<CameraParameters> known_camera(const std::string& name) {
  // As the authors of the data sets publish them.
  const auto camera = [](double fx, double fy, double cx, double cy, double k1 = 0, double k2 = 0,
                         double p1 = 0, double p2 = 0, double k3 = 0) {
    return CameraParameters{fx, fy, cx, cy, k1, k2, p1, p2, k3, {640, 480}, 30, 5000, 0};
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

CameraParameters read_camera(const std::filesystem::path& path) {
  if (!detail::exists(path)) {
    if (const std::optional<CameraParameters> known = known_camera(path.string())) return *known;
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
  CameraParameters camera = detail::read_pinhole<CameraParameters>(file);
  camera.image_size = {read_pixels("Camera.width"), read_pixels("Camera.height")};
  if (camera.image_size.empty()) camera.image_size = {};  // one side alone says nothing
  camera.frames_per_second = read("Camera.fps");
  camera.depth_units_per_metre = read(factor);
  camera.depth_offset_s = read("dynfilter.depth_offset_s");
  for (const auto& number : numbers) {
    if (const char* want = wanted(number.range, camera.*number.value)) {
      const std::string read_key =
          number.name == std::string("depth_units_per_metre") ? factor : prefix + number.name;
      const std::string key = file.has(read_key) ? read_key : number.key;
      file.refuse(key, file.shown(key), want);
    }
  }
  return camera;
}

std::string camera_file_text(const CameraParameters& camera) {
  for (const auto& number : numbers) {
    const double value = camera.*number.value;
    if (const char* want = wanted(number.range, value)) {
      detail::throw_misuse("camera_file_text", detail::concatenate(number.name, " = ", value),
                           want);
    }
  }
  std::string text = "%YAML:1.0\n---\n";
  const auto add = [&](const char* key, const std::string& value) {
    text += std::string(key) + ": " + value + "\n";
  };
  for (int k = 0; k < model_numbers; ++k) {
    add(numbers[k].key, real_text(camera.*numbers[k].value));
  }
  if (camera.image_size.width > 0 && camera.image_size.height > 0) {
    add("Camera.width", std::to_string(camera.image_size.width));
    add("Camera.height", std::to_string(camera.image_size.height));
  }
  if (camera.frames_per_second > 0) add("Camera.fps", real_text(camera.frames_per_second));
  add("DepthMapFactor", real_text(camera.depth_units_per_metre));
  if (camera.depth_offset_s != 0) {
    add("dynfilter.depth_offset_s", real_text(camera.depth_offset_s));
  }
  return text;
}

}  // namespace dynfilter
