// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/detail/rotation.hpp"
#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/text_table.hpp"

namespace dynfilter {
namespace {

using detail::concatenate;
using detail::TableReader;
using detail::throw_file_error;
using detail::throw_misuse;

constexpr double kitti_frame_s = 0.1;  // KITTI's odometry has ten frames a second

/// What the rows of a file hold, by the columns of the first.
enum class Form { tum, euroc, kitti };

constexpr std::size_t euroc_columns = 17;  // also velocity and biases
constexpr std::size_t vins_columns = 11;   // also velocity; VINS ends its rows with a comma
constexpr std::size_t kitti_columns = 12;  // the upper rows of a 4x4 matrix

/// Returns the number of columns; a comma at the end of a row begins none.
std::size_t width_of(const TableReader& table) {
  return table.columns() - (table.text(table.columns() - 1).empty() ? 1 : 0);
}

Form form_of(const TableReader& table, std::size_t columns) {
  constexpr const char* want =
      "8: timestamp tx ty tz qx qy qz qw; or EuRoC's 17 in each row, or KITTI's 12. If the first 8 "
      "are these, as OpenVINS and RTAB-Map write them, keep them: cut -d' ' -f1-8 FILE";
  if (columns == kitti_columns) {
    if (width_of(table) == columns) return Form::kitti;
    table.fail(concatenate("got ", table.columns(), " columns; want KITTI's 12 as above"));
  }
  table.require_columns(8, want);
  const bool is_vins = columns == vins_columns && table.has_separator();
  const bool is_euroc = columns == euroc_columns || is_vins;
  if (width_of(table) != columns || (columns > 8 && !is_euroc)) {
    table.fail(concatenate("got ", table.columns(), " columns; want ", want));
  }
  // EuRoC's and TUM-VI's motion capture has eight columns, too.
  const bool is_csv =
      table.has_separator() && detail::parse_number(table.text(0)).value_or(0) >= 1e17;
  return is_euroc || is_csv ? Form::euroc : Form::tum;
}

/// Tells whether Python's float(), which TUM's scripts use, reads the cell as NaN.
bool is_nan(const std::string& cell) {
  const std::size_t sign = !cell.empty() && (cell[0] == '+' || cell[0] == '-') ? 1 : 0;
  const std::string rest = cell.substr(sign);
  return rest.size() == 3 && (rest[0] | 0x20) == 'n' && (rest[1] | 0x20) == 'a' &&
         (rest[2] | 0x20) == 'n';
}

/// Reads the numbers of a row; none if one is NaN.
std::vector<double> read_numbers(const TableReader& table, Form form) {
  static const std::vector<const char*> poses = {"time", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
  static const std::vector<const char*> matrices = {"r11", "r12", "r13", "tx",  "r21", "r22",
                                                    "r23", "ty",  "r31", "r32", "r33", "tz"};
  std::vector<double> numbers;
  bool has_nan = false;
  for (const char* name : form == Form::kitti ? matrices : poses) {
    const std::size_t k = numbers.size();
    const bool is_time = k == 0 && form != Form::kitti;
    const bool is_number = !is_nan(table.text(k));
    numbers.push_back(!is_number ? 0 : is_time ? table.time(k) : table.number(k, name));
    has_nan = has_nan || !is_number;
  }
  return has_nan ? std::vector<double>() : numbers;
}

/// Returns the pose in KITTI's row of numbers, which has no time.
TimedPose matrix_row(const TableReader& table, const std::vector<double>& m, double time_s) {
  const cv::Matx33d rotation(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
  if (!detail::is_rotation(rotation)) {
    table.fail("the matrix of KITTI's 12 columns is no rotation; want r11 r12 r13 tx r21 …");
  }
  return {{detail::rotation_of_quaternion(detail::quaternion_of(rotation)), {m[3], m[7], m[11]}},
          time_s};
}

/// Reads the current row; std::nullopt for a row to skip, which is counted in `flaws`.
std::optional<TimedPose> read_row(const TableReader& table, Form form, double index_time_s,
                                  TrajectoryFlaws& flaws) {
  const std::vector<double> n = read_numbers(table, form);
  if (n.empty()) {
    flaws.not_a_number.add(table.line());
    return {};
  }
  if (form == Form::kitti) return matrix_row(table, n, index_time_s);
  const cv::Vec4d q =
      form == Form::euroc ? cv::Vec4d(n[5], n[6], n[7], n[4]) : cv::Vec4d(n[4], n[5], n[6], n[7]);
  const double length = cv::norm(q);
  if (length == 0) {
    flaws.zero_quaternion.add(table.line());
    return {};
  }
  // Files have as few as four decimals. Farther from 1, the columns mean something else.
  if (!(std::abs(length - 1) <= 0.1)) {
    table.fail(concatenate("a quaternion of length ", length, "; want length 1"));
  }
  return TimedPose{{detail::rotation_of_quaternion(q / length), {n[1], n[2], n[3]}}, n[0]};
}

std::int64_t time_of(const TimedPose& pose) { return detail::microseconds(pose.timestamp_s); }

/// Reads the usable rows, in the order of the file, with their lines.
std::vector<std::pair<TimedPose, std::size_t>> read_usable_rows(TableReader& table,
                                                                TrajectoryFile& file) {
  TrajectoryFlaws& flaws = file.flaws;
  std::vector<std::pair<TimedPose, std::size_t>> rows;
  std::vector<double> times;
  std::size_t columns = 0;
  for (std::size_t index = 0; table.next(); ++index) {
    if (index == 0) columns = width_of(table);
    const Form form = form_of(table, columns);
    file.has_times = form != Form::kitti;
    const auto pose = read_row(table, form, static_cast<double>(index) * kitti_frame_s, flaws);
    if (!pose) continue;
    if (!rows.empty() && time_of(*pose) < time_of(rows.back().first)) {
      flaws.time_goes_back.add(table.line());
    }
    rows.emplace_back(*pose, table.line());
    times.push_back(pose->timestamp_s);
  }
  if (detail::are_too_far_apart(times)) throw_file_error(table.path(), detail::far_apart_text);
  if (rows.empty()) {
    throw_file_error(table.path(),
                     concatenate("holds no usable pose; of its rows, ", flaws.not_a_number.count,
                                 " have NaN, ", flaws.zero_quaternion.count, " a zero quaternion"));
  }
  return rows;
}

}  // namespace

TrajectoryFile read_trajectory_file(const std::filesystem::path& path) {
  TableReader table(path);
  TrajectoryFile file;
  auto rows = read_usable_rows(table, file);
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) {
    return time_of(a.first) < time_of(b.first);
  });
  for (const auto& [pose, line] : rows) {
    if (!file.trajectory.empty() && time_of(pose) == time_of(file.trajectory.back())) {
      file.flaws.repeated_time.add(line);
      file.trajectory.back() = pose;
    } else {
      file.trajectory.push_back(pose);
    }
  }
  return file;
}

Trajectory read_trajectory(const std::filesystem::path& path) {
  return read_trajectory_file(path).trajectory;
}

std::string detail::trajectory_row(const TimedPose& pose, const char* component) {
  const cv::Vec3d& t = pose.translation;
  if (!is_rotation(pose.rotation)) {
    throw_misuse(component, "a rotation that is not orthonormal", "a rotation matrix");
  }
  const bool is_finite = std::all_of(t.val, t.val + 3, [](double x) { return std::isfinite(x); });
  if (!is_time_in_seconds(pose.timestamp_s) || !is_finite) {
    throw_misuse(component,
                 concatenate("time ", pose.timestamp_s, " s, translation (", t[0], " ", t[1], " ",
                             t[2], ")"),
                 "a time in seconds and finite metres");
  }
  const cv::Vec4d quaternion = quaternion_of(pose.rotation);
  std::string text = time_text(pose.timestamp_s);
  for (int i = 0; i < 3; ++i) text += ' ' + fixed_decimals(t[i], 7);
  for (int i = 0; i < 4; ++i) text += ' ' + fixed_decimals(quaternion[i], 9);
  return text;
}

void write_trajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  constexpr const char* component = "write_trajectory";
  std::string text;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    text += detail::trajectory_row(trajectory[i], component) + '\n';
    if (i == 0 || time_of(trajectory[i]) > time_of(trajectory[i - 1])) continue;
    throw_misuse(component,
                 "time " + detail::time_text(trajectory[i].timestamp_s) + " after " +
                     detail::time_text(trajectory[i - 1].timestamp_s),
                 "times that increase");
  }
  detail::write_file(path, text);
}

}  // namespace dynfilter
