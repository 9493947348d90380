// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "shared_options.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"
#ifdef DYNFILTER_HAS_NETWORKS
#include "dynfilter/networks/network_segmenter.hpp"
#endif
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
#include "dynfilter/remote/remote_segmenter.hpp"
#endif

namespace dynfilter::tools {

std::string SegmenterSpec::name() const {
  return remote.empty() ? model.string() : "process at " + remote;
}

std::unique_ptr<Segmenter> SegmenterSpec::make() const {
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  if (!remote.empty()) {
    RemoteSegmenterOptions options;
    options.timeout_s = remote_timeout_s;
    options.retry_interval_s = 0.1;  // either side may start first
    return std::make_unique<RemoteSegmenter>(remote, options);
  }
#endif
#ifdef DYNFILTER_HAS_NETWORKS
  if (!model.empty()) {
    NetworkOptions options;
    options.device = device;
    return std::make_unique<NetworkSegmenter>(model, options);
  }
#endif
  throw std::runtime_error("this dynfilter was built without " +
                           std::string(remote.empty() ? "networks" : "ZeroMQ (cppzmq-dev)"));
}

std::vector<int> class_ids(std::vector<std::string> classes,
                           [[maybe_unused]] const Segmenter* segmenter) {
  std::vector<std::string> names = {"person"};
#ifdef DYNFILTER_HAS_NETWORKS
  const auto* network = dynamic_cast<const NetworkSegmenter*>(segmenter);
  if (network != nullptr && !network->class_names().empty()) names = network->class_names();
#endif
  const auto place_of = [&](const std::string& name) {
    return static_cast<double>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const auto unknown = static_cast<double>(names.size());
  std::string known;
  for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
  if (classes.empty() && place_of("person") == unknown) {
    const std::string what = "the network knows no person, but " + known + "; --classes chooses";
    std::fprintf(stderr, "%s [%s]\n", detail::shown(what).c_str(), names[0].c_str());
  }
  if (classes.empty()) classes = {place_of("person") < unknown ? "person" : names[0]};
  std::vector<int> ids;
  for (const std::string& one : classes) {
    const double place = place_of(one);
    const double id = place < unknown ? place : detail::parse_number(one).value_or(-1);
    if (!(id >= 0 && id <= std::numeric_limits<int>::max()) || id != std::floor(id)) {
      throw std::runtime_error(detail::shown(detail::concatenate(
          "--classes: got ", one, "; want ids from 0 on, or names of ", known)));
    }
    ids.push_back(static_cast<int>(id));
  }
  return ids;
}

void add_recording_options(CLI::App& command, SceneSpec& scene, CLI::Option* sequence) {
  command
      .add_option("--masks", scene.masks,
                  "folder of the masks, or those of other tools: COCO's .json, YOLO's .txt, CVAT's "
                  "or MOTS'\n[SEQUENCE/masks]; dynfilter masks makes them")
      ->needs(sequence);
  command
      .add_option_function<std::string>(
          "--missing-masks",
          [&scene](const std::string& text) { scene.keeps_missing = text == "keep"; },
          "of images without a mask: error; or keep, so that masks remove nothing there")
      ->check(CLI::IsMember({"error", "keep"}))
      ->default_str("error")
      ->needs(sequence);
  command
      .add_option("--camera", scene.reading.camera_file,
                  "camera file, or tum1, tum2, tum3 or bonn [SEQUENCE/camera.yaml]")
      ->needs(sequence);
  add_depth_offset_option(command, scene.reading.depth_offset_s)->needs(sequence);
}

void add_segmenter_options(CLI::App& command, SegmenterSpec& segmenter) {
  CLI::Option* remote = command.add_option(
      "--remote", segmenter.remote,
      "use the masks of the process that listens at this address, see examples/remote_masks");
  command
      .add_option("--remote-timeout", segmenter.remote_timeout_s,
                  "longest wait for the masks of a frame, seconds")
      ->needs(remote)
      ->check(CLI::Range(0.001, 3600.0))
      ->capture_default_str();
#ifdef DYNFILTER_HAS_NETWORKS
  CLI::Option* model =
      command.add_option("--model", segmenter.model, "use the masks of this network, an ONNX file");
  model->excludes(remote);
  command
      .add_option("--device", segmenter.device,
                  "what OpenCV runs the network on: cpu, opencl, cuda or openvino")
      ->needs(model)
      ->capture_default_str();
#endif
}

Segmentation masks_of(Segmenter& segmenter, FrameView frame, std::size_t i, std::size_t frames) {
  frame.depth.release();  // without a camera file, its unit is not known
  try {
    return segmenter.segment(frame);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(detail::concatenate(error.what(), " (nothing was written; ", i, " of ",
                                                 frames, " frames had masks)"));
  }
}

}  // namespace dynfilter::tools
