// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_BENCH_PEERS_DLIB_LBP_HPP
#define DYNFILTER_BENCH_PEERS_DLIB_LBP_HPP

#include <memory>

#include <opencv2/core.hpp>

namespace dynfilter::peers {

/// Local binary pattern of dlib, make_uniform_lbp_image: compares like D-LBP, then maps the 256
/// patterns to 59. Only if the benchmarks were built with dlib.
class DlibLbp {
 public:
  /// Takes a copy of a CV_16UC1 image, in dlib's own matrix.
  explicit DlibLbp(const cv::Mat& image);
  ~DlibLbp();

  void make_codes();

  /// Codes of the last call, of the image's size.
  cv::Mat codes() const;

 private:
  struct Matrices;
  std::unique_ptr<Matrices> matrices_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_BENCH_PEERS_DLIB_LBP_HPP
