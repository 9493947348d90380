// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/networks/yolact_segmenter.hpp"

#include <memory>
#include <utility>

#include "loaded_network.hpp"
#include "yolact_kind.hpp"

namespace dynfilter {
namespace {

constexpr const char* name = "YolactSegmenter";

std::unique_ptr<detail::LoadedNetwork> load(const std::filesystem::path& model,
                                            const NetworkOptions& options) {
  detail::require_valid(options, name);
  detail::Network network(model, options.input_size);
  const std::vector<detail::NamedTensor> trial = detail::outputs_of_trial(network);
  auto kind = std::make_unique<detail::YolactKind>(network.input_size(), options);
  return detail::assemble(std::move(network), trial, std::move(kind), options, name);
}

}  // namespace

YolactSegmenter::YolactSegmenter(const std::filesystem::path& model, const NetworkOptions& options)
    : NetworkSegmenter(load(model, options)) {}

}  // namespace dynfilter
