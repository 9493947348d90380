// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_judge.hpp"

#include <cstring>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/grey_image.hpp"
#include "motion_frame.hpp"
#include "pose_prior.hpp"

namespace dynfilter {
namespace {

using detail::MotionContext;
using detail::MotionMemory;

/// In smaller images, features cannot be followed.
constexpr int min_side_px = 40;

void check_options(const MotionJudgeOptions& options, double stale_age_s) {
  static constexpr detail::OptionCheck require("MotionJudge");
  require(options.min_speed_m_s >= 0, "min_speed_m_s", options.min_speed_m_s,
          "a number of at least 0");
  require(options.max_gap_s > 0, "max_gap_s", options.max_gap_s, "a number above 0");
  require(options.still_frames >= 1 && options.still_frames <= 1000, "still_frames",
          options.still_frames, "1 to 1000");
  require(options.fringe_px >= 0 && options.fringe_px <= 1000, "fringe_px", options.fringe_px,
          "0 to 1000");
  require(stale_age_s >= 0, "stale_age_s", stale_age_s, "a number of at least 0");
}

const Camera& checked(const Camera& camera) {
  validate(camera, "MotionJudge");
  return camera;
}

void require_grey_or_colour(const cv::Mat& image) {
  const int type = image.type();
  if (image.empty() || type == CV_8UC1 || type == CV_8UC3 || type == CV_8UC4) return;
  detail::throw_misuse("MotionJudge",
                       detail::concatenate("an image of type ", detail::type_name(image)),
                       "CV_8UC1, CV_8UC3 or CV_8UC4");
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
  detail::grey_of(frame.image, now.grey[0]).copyTo(now.grey[0]);  // hosts reuse their buffers
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
  if (!context.has_masks) return;
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

/// Judges a frame that follows another, and remembers it. Each step reads what those before it
/// found, and writes its own array.
MotionOutcome judge(const MotionContext& context, FeatureLabels& labels) {
  using detail::long_baseline, detail::short_baseline;
  detail::MotionFindings& found = context.scratch.found;
  found.reset(context.input.features.size());
  begin_verdicts(context);
  read_places(context, found.places, found.patches);
  suspect_features(context, labels, found.suspects);
  const detail::CameraEstimate camera = measure_camera(context);
  found.over[short_baseline] = camera.over;
  if (camera.outcome == MotionOutcome::started) {
    start(context);
    return camera.outcome;
  }
  for (const std::size_t b : {short_baseline, long_baseline}) {
    if (b == long_baseline) found.over[b] = measure_long_baseline(context);
    if (!found.over[b].is_used) continue;
    track_features(context, b, found.tracks[b]);
    found.over[b] = refined(context, b);
  }
  for (const detail::PatchTrack& track : found.tracks[short_baseline]) {
    labels.statistics().motion.tracked += track.is_found ? 1 : 0;
  }
  const bool is_applied = camera.outcome == MotionOutcome::applied;
  if (is_applied) {
    measure_shifts(context, found.shifts);
    gather_evidence(context, found.evidence);
    support_candidates(context, labels, found.supported);
    update_beliefs(context, found.beliefs);
    find_moving(context, found.moving);
  }
  judge_instances(context, labels);
  if (is_applied) write_labels(context, labels);
  remember(context);
  return camera.outcome;
}

}  // namespace

MotionJudge::MotionJudge(const Camera& camera, const MotionJudgeOptions& options,
                         double stale_age_s)
    : camera_(checked(camera)),
      options_(options),
      stale_age_s_(stale_age_s),
      pose_estimator_(camera),
      memory_(std::make_unique<MotionMemory>(options.still_frames)) {
  check_options(options, stale_age_s);
}

MotionJudge::MotionJudge(MotionJudge&&) noexcept = default;
MotionJudge& MotionJudge::operator=(MotionJudge&&) noexcept = default;
MotionJudge::~MotionJudge() = default;

void MotionJudge::expect_motion(const PosePrior& prior) {
  detail::validate(prior, "MotionJudge::expect_motion");
  memory_->handed_over = prior;
}

void MotionJudge::reset() {
  memory_->forget();
  memory_->handed_over.reset();
}

void MotionJudge::operator()(const FilterInput& input, FeatureLabels& labels,
                             Workspace& workspace) {
  MotionMemory& memory = *memory_;
  memory.prior = std::exchange(memory.handed_over, std::nullopt);
  validate(input, labels, "MotionJudge");
  require_grey_or_colour(input.frame.image);
  MotionOutcome& outcome = labels.statistics().motion.outcome;
  labels.statistics().motion = {};
  auto& scratch = workspace.get<detail::MotionScratch>();
  const MotionContext context{input,        camera_,         options_,
                              stale_age_s_, pose_estimator_, labels.statistics().has_segmentation,
                              memory,       scratch.found,   scratch,
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
  } catch (...) {
    memory.forget();
    throw;
  }
}

}  // namespace dynfilter
