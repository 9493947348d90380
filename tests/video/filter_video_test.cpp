// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "video/filter_video.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/overlay.hpp"
#include "support/host_frame.hpp"
#include "support/temporary_folder.hpp"
#ifdef DYNFILTER_HAS_VIDEO
#include "support/video_pictures.hpp"
#endif

namespace dynfilter::testing {
namespace {

/// Counts the rows of a picture's strip that have text.
int rows_with_text(const cv::Mat& strip) {
  int rows = 0;
  for (int y = 0; y < strip.rows; ++y) {
    cv::Mat bright = strip.row(y).reshape(1) > 150;
    rows += cv::countNonZero(bright) > 0 ? 1 : 0;
  }
  return rows;
}

TEST(LinesBelow, StandBelowTheEnlargedPicture) {
  const cv::Mat narrow(60, 250, CV_8UC3, cv::Scalar(1, 2, 3));
  const std::string longest(500, 'm');
  const cv::Mat with = detail::with_lines_below(narrow, {"a", "", longest});
  ASSERT_EQ(with.size(), cv::Size(750, 180 + 3 * 18)) << "three times as large";
  EXPECT_EQ(with.at<cv::Vec3b>(179, 749), cv::Vec3b(1, 2, 3));
  EXPECT_GT(rows_with_text(with.rowRange(180, 198)), 0);
  EXPECT_EQ(rows_with_text(with.rowRange(198, 216)), 0);
  EXPECT_EQ(rows_with_text(with.rowRange(216, 234).colRange(746, 750)), 0) << "it fits";
  const cv::Mat wide(60, 641, CV_8UC3, cv::Scalar(1, 2, 3));
  EXPECT_EQ(detail::with_lines_below(wide, {"a"}).size(), cv::Size(641, 78));
}

#ifdef DYNFILTER_HAS_VIDEO
TEST(FilterVideo, ShowsTheOverlayAndWhatIsKnown) {
  const TemporaryFolder folder;
  const HostFrame host(0);
  FilterHealthReport bad;
  bad.mask_age_s = {0.5, HealthVerdict::bad, 20};
  cv::Mat overlay;
  {
    detail::FilterVideo video(folder / "film.avi");
    for (const bool has_masks : {true, false}) {
      const std::optional<Segmentation> masks =
          has_masks ? std::optional(host.segmentation) : std::nullopt;
      const FeatureLabels labels = DynamicFilter().apply(host.view(0), masks, host.keypoints);
      const Segmentation shown = masks.value_or(Segmentation());
      video.add(host.view(0), shown, host.keypoints, labels, bad);
      if (has_masks) overlay = draw_overlay(host.image, shown, host.keypoints, labels);
      FrameView unseen = host.view(0);
      unseen.image.release();
      video.add(unseen, shown, host.keypoints, labels, bad);  // is not shown
    }
    video.finish();
  }
  const std::vector<cv::Mat> pictures = video_pictures(folder / "film.avi");
  ASSERT_EQ(pictures.size(), 2U);
  const cv::Mat want = detail::with_lines_below(
      overlay,
      {"frame 1 at 100.000000 s, 391 features, " +
           std::to_string(DynamicFilter()
                              .apply(host.view(0), host.segmentation, host.keypoints)
                              .statistics()
                              .kept()) +
           " kept; masks 0.000 s old, 1 instances",
       "so far: 1 frames, 0 without masks, 0 starved", "health: age of the masks 0.500 s, bad"});
  ASSERT_EQ(pictures[0].size(), want.size());
  ASSERT_EQ(host.keypoints.size(), 391U);
  // Motion JPEG changes pixels a little.
  EXPECT_LT(cv::norm(pictures[0], want, cv::NORM_L1) / static_cast<double>(want.total()), 20);
  const int line = overlay.rows * 4;
  const cv::Mat texts = want.rowRange(line, want.rows);
  const cv::Mat other = detail::with_lines_below(overlay, {"", "", ""}).rowRange(line, want.rows);
  const cv::Mat got = pictures[0].rowRange(line, want.rows);
  EXPECT_LT(2 * cv::norm(got, texts, cv::NORM_L1), cv::norm(got, other, cv::NORM_L1))
      << "the lines say what was expected";
}
#endif

}  // namespace
}  // namespace dynfilter::testing
