// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Sources of masks: a folder, a thread, propagation, a network, another process.

#include "dynfilter/plugin.hpp"

#include "support/host_frame.hpp"
#include "support/test.hpp"
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
#include "support/remote_peer.hpp"
#endif

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

TEST_F(PluginTest, AFrameGetsItsOwnMasksWhateverWasFilteredBefore) {
  Plugin usual(settings());
  for (const char* lines : {"", "dynfilter.async: \"wait\"\n", "dynfilter.propagate: \"yes\"\n",
                            "dynfilter.async: \"wait\"\ndynfilter.propagate: \"yes\"\n"}) {
    SCOPED_TRACE(lines);
    Plugin plugin(settings(lines));
    for (const int earlier : {0, 4}) {
      submit(plugin, 2);
      EXPECT_EQ(kept(plugin, earlier), kept(usual, earlier)) << "was never submitted";
      EXPECT_EQ(kept(plugin, 2), kept(usual, 2));
      EXPECT_EQ(kept(plugin, 2), kept(usual, 2)) << "a second time";
    }
    EXPECT_EQ(plugin.counters().without_masks, 0U);
  }
}

TEST_F(PluginTest, AsyncGivesUpFramesThatAreNeverFiltered) {
  Plugin usual(settings()), plugin(settings("dynfilter.async: \"wait\"\n"));
  for (int i = 0; i < 30; ++i) submit(plugin, i % frames);
  EXPECT_EQ(kept(plugin, 29 % frames), kept(usual, 29 % frames));
  EXPECT_EQ(plugin.counters().never_filtered, 29U);
}

TEST_F(PluginTest, PropagationBridgesAFrameWithoutAMask) {
  const char* keep = "dynfilter.missing_masks: \"keep\"\n";
  Plugin without(settings(keep));
  Plugin with(settings(std::string(keep) + "dynfilter.propagate: \"yes\"\n"));
  const std::size_t all = HostFrame(frames).keypoints.size();
  EXPECT_EQ(kept_in_frames(without, frames + 1).back().size(), all);
  EXPECT_LT(kept_in_frames(with, frames + 1).back().size(), all);
}

void refuses_file(const std::string& file, const std::string& part) {
  expect_error<std::runtime_error>([&] { Plugin plugin(file); }, part);
}

TEST_F(PluginTest, NeedsExactlyOneSourceOfMasks) {
  refuses_file(raw_settings("dynfilter.floor: 3\n"), "dynfilter.mask_folder: got nothing");
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  refuses_file(settings("dynfilter.remote: \"socket\"\n"), "got mask_folder and remote");
#else
  refuses_file(raw_settings("dynfilter.remote: \"socket\"\n"), "was built without remote masks");
#endif
}

#ifdef DYNFILTER_HAS_NETWORKS
TEST_F(PluginTest, NamesANetworkThatCannotBeLoaded) {
  refuses_file(raw_settings("dynfilter.model: \"no_such.onnx\"\n"), "no_such.onnx");
  refuses_file(settings("dynfilter.model: \"no_such.onnx\"\n"), "got mask_folder and model");
}
#endif

#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
std::string remote_settings(const fs::path& socket) {
  return "dynfilter.remote: \"" + socket.string() + "\"\n";
}

/// Repeats what a busy machine did not do within the plugin's limit.
template <class Action>
void in_time(const Action& action) try {
  action();
} catch (const std::runtime_error& error) {
  if (std::string(error.what()).find("time is up") == std::string::npos) throw;
  in_time(action);
}

TEST_F(PluginTest, UsesMasksFromAnotherProcess) {
  std::atomic<bool> is_slow{false};
  const RemotePeer peer(path("socket"), [&](const FrameView& frame, std::uint64_t request) {
    EXPECT_EQ(frame.image.size(), image_size);
    if (is_slow.exchange(false)) std::this_thread::sleep_for(std::chrono::milliseconds(1200));
    const HostFrame known(static_cast<int>(std::lround((frame.timestamp_s - 100) / 0.1)));
    return reply(request, known.segmentation.instances);
  });
  Plugin folder(settings());
  const auto expected = kept_in_frames(folder, frames);
  in_time([&] {
    Plugin remote(raw_settings(remote_settings(path("socket"))));
    EXPECT_EQ(kept_in_frames(remote, frames), expected);
  });
  is_slow = true;
  Plugin in_thread(raw_settings(remote_settings(path("socket")) + "dynfilter.async: \"wait\"\n"));
  EXPECT_EQ(kept_in_frames(in_thread, frames), expected) << "a thread has 10 s";
}

/// Answers with the masks of frame 2, whatever the frame.
Reply answer_with_frame_2(const FrameView&, std::uint64_t request) {
  return reply(request, HostFrame(2).segmentation.instances);
}

TEST_F(PluginTest, AsyncNamesAFrameThatWasNeverSubmitted) {
  const RemotePeer peer(path("socket"), answer_with_frame_2);
  Plugin usual(settings());
  in_time([&] {
    Plugin plugin(raw_settings(remote_settings(path("socket")) + "dynfilter.async: \"wait\"\n"));
    submit(plugin, 2);
    expect_error<std::invalid_argument>([&] { kept(plugin, 0); },
                                        "a frame of time 100.000000 that was not submitted");
    EXPECT_EQ(kept(plugin, 2), kept(usual, 2));
  });
}

TEST_F(PluginTest, AsyncLatestTakesMasksOfAnotherFrame) {
  const RemotePeer peer(path("socket"), [](const FrameView& frame, std::uint64_t request) {
    const bool is_second = frame.timestamp_s > 100.25;
    if (is_second) std::this_thread::sleep_for(std::chrono::milliseconds(200));
    return answer_with_frame_2(frame, request);
  });
  in_time([&] {
    Plugin plugin(raw_settings(remote_settings(path("socket")) + "dynfilter.async: \"latest\"\n"));
    submit(plugin, 2);
    // Until its masks have come, for frames that were never submitted.
    for (int k = 3; kept(plugin, k).size() == HostFrame(k).keypoints.size(); ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    submit(plugin, 3);  // whose masks take longer
    EXPECT_LT(kept(plugin, 3).size(), HostFrame(3).keypoints.size());
  });
}

TEST_F(PluginTest, WithoutAListenerItFailsOrContinuesAsConfigured) {
  HostFrame frame(0);
  for (const char* thread : {"", "dynfilter.async: \"wait\"\n"}) {
    Plugin strict(raw_settings(remote_settings(path("nobody")) + thread));
    for (int i = 0; i < 2; ++i) {
      submit(strict, i);
      for (int k = 0; k < 3; ++k) {  // a frame filtered again gets the same error
        expect_error<std::runtime_error>([&] { kept(strict, i); }, path("nobody").string());
      }
    }
    EXPECT_EQ(strict.counters().filtered, 0U);
    EXPECT_EQ(strict.counters().mask_failures, 0U);
  }

  const char* keep = "dynfilter.missing_masks: \"keep\"\n";
  for (const char* thread : {"", "dynfilter.async: \"wait\"\n"}) {
    Plugin lenient(raw_settings(remote_settings(path("nobody")) + keep + thread));
    ::testing::internal::CaptureStderr();
    EXPECT_EQ(kept_in_frames(lenient, 3).back().size(), frame.keypoints.size()) << thread;
    EXPECT_EQ(kept(lenient, 2).size(), frame.keypoints.size()) << "again";
    const std::string said = ::testing::internal::GetCapturedStderr();
    EXPECT_NE(said.find("dynfilter.remote: " + path("nobody").string()), std::string::npos) << said;
    EXPECT_EQ(said.find("go on without masks"), said.rfind("go on without masks")) << "said once";
    EXPECT_EQ(lenient.counters().mask_failures, 3U) << thread;
    EXPECT_EQ(lenient.counters().without_masks, 3U) << thread;
  }
}
#endif

}  // namespace
}  // namespace dynfilter::testing
