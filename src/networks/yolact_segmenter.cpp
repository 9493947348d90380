// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/networks/yolact_segmenter.hpp"

#include <cmath>
#include <memory>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "loaded_network.hpp"
#include "yolact_kind.hpp"

namespace dynfilter {
namespace detail {

void require_valid(const YolactOptions& options, const char* component) {
  require_valid(static_cast<const NetworkOptions&>(options), component);
  if (options.candidates_per_class < 1) {
    throw_misuse(component, concatenate("candidates_per_class = ", options.candidates_per_class),
                 "at least 1");
  }
  const cv::Mat& priors = options.priors;
  if (!priors.empty() && (priors.type() != CV_32FC1 || priors.dims != 2 || priors.cols != 4)) {
    throw_misuse(component, "priors " + type_name(priors) + ' ' + shape_text(shape_of(priors)),
                 "CV_32FC1 [N, 4]");
  }
  for (int c = 0; c < 3; ++c) {
    if (!std::isfinite(options.mean_rgb[c]) || !std::isfinite(options.deviation_rgb[c]) ||
        options.deviation_rgb[c] <= 0) {
      throw_misuse(component,
                   concatenate("mean_rgb ", options.mean_rgb[c], " and deviation_rgb ",
                               options.deviation_rgb[c]),
                   "finite numbers, deviations above 0");
    }
  }
}

}  // namespace detail

namespace {

constexpr const char* name = "YolactSegmenter";

std::unique_ptr<detail::LoadedNetwork> load(const std::filesystem::path& model,
                                            const YolactOptions& options) {
  detail::require_valid(options, name);
  detail::Network network(model, options.input_size);
  const std::vector<detail::NamedTensor> trial = detail::outputs_of_trial(network);
  auto kind = std::make_unique<detail::YolactKind>(network.input_size(), options);
  return detail::assemble(std::move(network), trial, std::move(kind), options, name);
}

}  // namespace

YolactSegmenter::YolactSegmenter(const std::filesystem::path& model, const YolactOptions& options)
    : NetworkSegmenter(load(model, options)) {}

}  // namespace dynfilter
