// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_judge.hpp"

#include <cstring>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "motion_frame.hpp"
#include "pose_prior.hpp"

namespace dynfilter {
namespace {

using detail::MotionContext;
using detail::MotionMemory;

constexpr int min_side_px = 40;  // of an image in which features can be followed

void check_options(const MotionJudgeOptions& options) {
  static constexpr detail::OptionCheck require("MotionJudge");
  require(options.min_speed_m_s >= 0, "min_speed_m_s", options.min_speed_m_s,
          "a number of at least 0");
  require(options.max_gap_s > 0, "max_gap_s", options.max_gap_s, "a number above 0");
  require(options.still_frames >= 1 && options.still_frames <= 1000, "still_frames",
          options.still_frames, "1 to 1000");
  require(options.fringe_px >= 0 && options.fringe_px <= 1000, "fringe_px", options.fringe_px,
          "0 to 1000");
  require(options.stale_age_s >= 0, "stale_age_s", options.stale_age_s, "a number of at least 0");
}

void require_grey_or_colour(const cv::Mat& image) {
  const int type = image.type();
  if (image.empty() || type == CV_8UC1 || type == CV_8UC3 || type == CV_8UC4) return;
  detail::throw_misuse("MotionJudge",
                       detail::concatenate("an image of type ", detail::type_name(image)),
                       "CV_8UC1, CV_8UC3 or CV_8UC4");
}

/// The host's tracks must be those of the frame's features.
void require_one_for_each(FeaturesView features, const MotionMemory& memory) {
  const std::size_t tracks = memory.host_tracks.size();
  if (tracks == 0 || tracks == features.size()) return;
  detail::throw_misuse(
      "MotionJudge",
      detail::concatenate(tracks, " tracks of the host and ", features.size(), " features"),
      "one track for each feature");
}

bool is_equal(const cv::Mat1b& a, const cv::Mat1b& b) {
  for (int y = 0; y < a.rows; ++y) {
    if (std::memcmp(a.ptr(y), b.ptr(y), static_cast<std::size_t>(a.cols)) != 0) return false;
  }
  return true;
}

/// Takes in the frame's image and time. Returns whether features can be followed in the image.
bool look(const FrameView& frame, MotionMemory::Frame& now) {
  now.timestamp_s = frame.timestamp_s;
  if (frame.image.cols < min_side_px || frame.image.rows < min_side_px) return false;
  if (frame.image.channels() == 1) {
    frame.image.copyTo(now.grey[0]);  // hosts reuse their buffers
  } else {
    const bool has_alpha = frame.image.channels() == 4;
    cv::cvtColor(frame.image, now.grey[0], has_alpha ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  }
  for (std::size_t level = 1; level < now.grey.size(); ++level) {
    cv::pyrDown(now.grey[level - 1], now.grey[level]);
  }
  return true;
}

/// Tells whether the last frame says something about this one; forgets it if not.
bool continues(MotionMemory& memory, double max_gap_s) {
  if (memory.known == 0) return false;
  const double gap_s = memory.now.timestamp_s - memory.past[0].timestamp_s;
  const bool is_known_size = memory.past[0].grey[0].size() == memory.now.grey[0].size();
  if (is_known_size && gap_s > 0 && gap_s <= max_gap_s) return true;
  memory.forget();
  return false;
}

/// Begins a frame's verdicts. Unknown masks say nothing of who is there: the verdicts wait for the
/// next known ones, but not for longer than a gap between frames may be.
void begin_verdicts(const MotionContext& context) {
  if (!context.has_masks && context.input.segmentation.instances.empty()) return;
  MotionMemory& memory = context.memory;
  const double gap_s = memory.now.timestamp_s - memory.instances_s;
  if (gap_s > context.options.max_gap_s) memory.instances.clear();
  memory.instances.begin_frame(context.input.segmentation);
  memory.instances_s = memory.now.timestamp_s;
}

/// Remembers a frame about which nothing is concluded.
void start(const MotionContext& context) {
  MotionMemory& memory = context.memory;
  memory.forget();
  begin_verdicts(context);
  memory.now.motion.reset();
  memory.push(context.input.frame);
}

/// Judges a frame that follows another, and remembers it.
MotionOutcome judge(const MotionContext& context, FeatureLabels& labels) {
  MotionStatistics& statistics = labels.statistics().motion;
  begin_verdicts(context);
  read_features(context);
  suspect_features(context, labels);
  const MotionOutcome outcome = measure_camera(context, statistics);
  if (outcome == MotionOutcome::started) {
    start(context);
    return outcome;
  }
  auto& over = context.scratch.over;
  for (std::size_t b = 0; b < detail::baselines; ++b) {
    if (b == detail::long_baseline) measure_long_baseline(context);
    if (!over[b].is_used) continue;
    track_features(context, b);
    refine_pose(context, b);
    ++statistics.baselines;
  }
  for (const detail::FeatureMotion& feature : context.scratch.features) {
    statistics.tracked += feature.tracks[detail::short_baseline].is_found ? 1 : 0;
  }
  if (outcome == MotionOutcome::applied) {
    statistics.scale_px = over[detail::short_baseline].scale_px;
    measure_motions(context);
    support_candidates(context, labels, statistics);
    update_beliefs(context);
  }
  judge_instances(context, labels);
  if (outcome == MotionOutcome::applied) write_labels(context, labels);
  remember(context);
  return outcome;
}

}  // namespace

MotionJudge::MotionJudge(const Camera& camera, const MotionJudgeOptions& options)
    : camera_(camera),
      options_(options),
      pose_estimator_(camera),
      memory_(std::make_unique<MotionMemory>(options.still_frames)) {
  check_options(options);
}

MotionJudge::MotionJudge(MotionJudge&&) noexcept = default;
MotionJudge& MotionJudge::operator=(MotionJudge&&) noexcept = default;
MotionJudge::~MotionJudge() = default;

void MotionJudge::expect_motion(const PosePrior& prior) {
  detail::validate(prior, "MotionJudge::expect_motion");
  memory_->prior = prior;
}

void MotionJudge::hand_over_tracks(std::vector<FeatureTrack> tracks) {
  memory_->host_tracks = std::move(tracks);
}

void MotionJudge::reset() {
  memory_->forget();
  memory_->end_frame();
}

void MotionJudge::check(const FilterInput& input) const {
  try {
    require_grey_or_colour(input.frame.image);
    require_one_for_each(input.features, *memory_);
  } catch (...) {
    memory_->end_frame();  // what was handed over is of this frame
    throw;
  }
}

void MotionJudge::operator()(const FilterInput& input, FeatureLabels& labels,
                             Workspace& workspace) {
  validate(input, labels, "MotionJudge");
  check(input);
  MotionMemory& memory = *memory_;
  MotionOutcome& outcome = labels.statistics().motion.outcome;
  labels.statistics().motion = {};
  const MotionContext context{input,
                              camera_,
                              options_,
                              pose_estimator_,
                              labels.statistics().has_segmentation,
                              memory,
                              workspace.get<detail::MotionScratch>(),
                              workspace};
  try {
    if (!look(input.frame, memory.now)) {
      memory.forget();
      outcome = MotionOutcome::no_image;
    } else if (!continues(memory, options_.max_gap_s)) {
      start(context);
      outcome = MotionOutcome::started;
    } else if (is_equal(memory.now.grey[0], memory.past[0].grey[0])) {
      memory.pass_over_repeat();
      outcome = MotionOutcome::repeated;
    } else {
      memory.join_repeats();
      outcome = judge(context, labels);
    }
    memory.end_frame();
  } catch (...) {
    reset();
    throw;
  }
}

}  // namespace dynfilter
