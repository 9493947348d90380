// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Program of every consumer of the core: exit code 0 if the package works.

#include <dynfilter/dynfilter.hpp>

int main() {
  cv::Mat mask = cv::Mat::zeros(48, 64, CV_8UC1);
  mask(cv::Rect(10, 20, 5, 5)) = 255;
  const dynfilter::Instance person = dynfilter::Instance::from_image_mask(mask);
  return person.covers({12, 22}) && !person.covers({9, 22}) ? 0 : 1;
}
