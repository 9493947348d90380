// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/camera.hpp"

#include <cmath>
#include <limits>
#include <locale>
#include <optional>
#include <sstream>
#include <string>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/camera_keys.hpp"
#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/yaml_file.hpp"

namespace dynfilter {
namespace {

/// The numbers of the camera model, and their keys.
constexpr struct {
  const char* key;
  double CameraParameters::*value;
} model[] = {{"Camera.fx", &CameraParameters::fx}, {"Camera.fy", &CameraParameters::fy},
             {"Camera.cx", &CameraParameters::cx}, {"Camera.cy", &CameraParameters::cy},
             {"Camera.k1", &CameraParameters::k1}, {"Camera.k2", &CameraParameters::k2},
             {"Camera.p1", &CameraParameters::p1}, {"Camera.p2", &CameraParameters::p2},
             {"Camera.k3", &CameraParameters::k3}};

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

void require_readable(const CameraParameters& camera) {
  const auto refuse = [](const char* name, double got, const char* want) {
    detail::throw_misuse("write_camera", detail::concatenate(name, " = ", got), want);
  };
  const auto positive = [&](const char* name, double value) {
    if (!(value > 0) || std::isinf(value)) refuse(name, value, "a finite number above 0");
  };
  const auto finite = [&](const char* name, double value) {
    if (!std::isfinite(value)) refuse(name, value, "a finite number");
  };
  positive("fx", camera.fx);
  positive("fy", camera.fy);
  positive("depth_units_per_metre", camera.depth_units_per_metre);
  finite("cx", camera.cx);
  finite("cy", camera.cy);
  for (const double k : {camera.k1, camera.k2, camera.p1, camera.p2, camera.k3}) {
    finite("a distortion coefficient", k);
  }
  finite("frames_per_second", camera.frames_per_second);
  if (camera.frames_per_second < 0) {
    refuse("frames_per_second", camera.frames_per_second, "at least 0");
  }
  if (!(std::abs(camera.depth_offset_s) <= max_depth_offset_s)) {
    refuse("depth_offset_s", camera.depth_offset_s, "a number within ±10 s");
  }
  if (camera.image_size.width < 0 || camera.image_size.height < 0) {
    detail::throw_misuse("write_camera", "image_size " + detail::size_name(camera.image_size),
                         "a size in pixels, or 0x0");
  }
}

}  // namespace

std::optional<CameraParameters> known_camera(const std::string& name) {
  // As the authors of the data sets publish them.
  const struct {
    const char* name;
    double fx, fy, cx, cy, k1, k2, p1, p2, k3;
  } cameras[] = {
      {"tum1", 517.306408, 516.469215, 318.643040, 255.313989,  //
       0.262383, -0.953104, -0.005358, 0.002628, 1.163314},
      {"tum2", 520.908620, 521.007327, 325.141442, 249.701764,  //
       0.231222, -0.784899, -0.003257, -0.000105, 0.917205},
      {"tum3", 535.4, 539.2, 320.1, 247.6, 0, 0, 0, 0, 0},
      {"bonn", 542.822841, 542.576870, 315.593520, 237.756098,  //
       0.039903, -0.099343, -0.000730, -0.000144, 0},
  };
  for (const auto& c : cameras) {
    if (name != c.name) continue;
    return CameraParameters{c.fx, c.fy, c.cx,       c.cy, c.k1, c.k2, c.p1,
                            c.p2, c.k3, {640, 480}, 30,   5000, 0};
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
  const auto require = [&](bool is_right, const std::string& key, const char* want) {
    if (!is_right) file.refuse(key, file.shown(key), want);
  };
  const auto read_pixels = [&](const char* key) {
    const double value = read(key);
    const bool is_whole = value >= 0 && value == std::floor(value);
    require(is_whole && value <= std::numeric_limits<int>::max(), key, "a whole number of pixels");
    return static_cast<int>(value);
  };
  CameraParameters camera = detail::read_pinhole<CameraParameters>(file);
  camera.image_size = {read_pixels("Camera.width"), read_pixels("Camera.height")};
  if (camera.image_size.empty()) camera.image_size = {};  // one side alone says nothing
  camera.frames_per_second = read("Camera.fps");
  camera.depth_units_per_metre = read(factor);
  camera.depth_offset_s = read("dynfilter.depth_offset_s");
  require(camera.fx > 0, prefix + "fx", "a number above 0");
  require(camera.fy > 0, prefix + "fy", "a number above 0");
  require(camera.depth_units_per_metre > 0, factor, "a number above 0");
  require(camera.frames_per_second >= 0, "Camera.fps", "a number of at least 0");
  require(std::abs(camera.depth_offset_s) <= max_depth_offset_s, "dynfilter.depth_offset_s",
          "a number within ±10");
  return camera;
}

std::string camera_file_text(const CameraParameters& camera) {
  require_readable(camera);
  std::string text = "%YAML:1.0\n---\n";
  const auto add = [&](const char* key, const std::string& value) {
    text += std::string(key) + ": " + value + "\n";
  };
  for (const auto& number : model) add(number.key, real_text(camera.*number.value));
  if (!camera.image_size.empty()) {
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

void write_camera(const std::filesystem::path& path, const CameraParameters& camera) {
  detail::write_file(path, camera_file_text(camera));
}

}  // namespace dynfilter
