// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/camera.hpp"

#include <cmath>
#include <limits>
#include <locale>
#include <sstream>
#include <string>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_writing.hpp"
#include "io/yaml_file.hpp"

namespace dynfilter {
namespace {

/// Reads one camera file.
class CameraFile {
 public:
  explicit CameraFile(const std::filesystem::path& path) : file_(path) {
    if (file_.keys().empty()) file_.refuse("holds no keys such as Camera.fx");
  }

  double required(const char* key) const {
    if (!file_.has(key)) file_.refuse(std::string(key) + " is missing");
    return optional(key);
  }

  double positive(const char* key) const {
    const double value = required(key);
    if (!(value > 0)) file_.refuse(key, file_.shown(key), "a number above 0");
    return value;
  }

  double optional(const char* key) const { return file_.number(key).value_or(0); }

  double optional_not_negative(const char* key) const {
    const double value = optional(key);
    if (value < 0) file_.refuse(key, file_.shown(key), "a number of at least 0");
    return value;
  }

  double optional_within(const char* key, double limit) const {
    const double value = optional(key);
    if (std::abs(value) > limit) {
      file_.refuse(key, file_.shown(key), detail::concatenate("a number within ±", limit));
    }
    return value;
  }

  int optional_pixels(const char* key) const {
    const double value = optional(key);
    if (value < 0 || value != std::floor(value) || value > std::numeric_limits<int>::max()) {
      file_.refuse(key, file_.shown(key), "a whole number of pixels");
    }
    return static_cast<int>(value);
  }

 private:
  detail::YamlFile file_;
};

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

CameraParameters read_camera(const std::filesystem::path& path) {
  const CameraFile file(path);
  CameraParameters camera;
  camera.fx = file.positive("Camera.fx");
  camera.fy = file.positive("Camera.fy");
  camera.cx = file.required("Camera.cx");
  camera.cy = file.required("Camera.cy");
  camera.k1 = file.optional("Camera.k1");
  camera.k2 = file.optional("Camera.k2");
  camera.p1 = file.optional("Camera.p1");
  camera.p2 = file.optional("Camera.p2");
  camera.k3 = file.optional("Camera.k3");
  camera.image_size.width = file.optional_pixels("Camera.width");
  camera.image_size.height = file.optional_pixels("Camera.height");
  if (camera.image_size.empty()) camera.image_size = {};  // one side alone says nothing
  camera.frames_per_second = file.optional_not_negative("Camera.fps");
  camera.depth_units_per_metre = file.positive("DepthMapFactor");
  camera.depth_offset_s = file.optional_within("dynfilter.depth_offset_s", max_depth_offset_s);
  return camera;
}

std::string camera_file_text(const CameraParameters& camera) {
  require_readable(camera);
  std::string text = "%YAML:1.0\n---\n";
  const auto add = [&](const char* key, const std::string& value) {
    text += std::string(key) + ": " + value + "\n";
  };
  add("Camera.fx", real_text(camera.fx));
  add("Camera.fy", real_text(camera.fy));
  add("Camera.cx", real_text(camera.cx));
  add("Camera.cy", real_text(camera.cy));
  add("Camera.k1", real_text(camera.k1));
  add("Camera.k2", real_text(camera.k2));
  add("Camera.p1", real_text(camera.p1));
  add("Camera.p2", real_text(camera.p2));
  add("Camera.k3", real_text(camera.k3));
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
