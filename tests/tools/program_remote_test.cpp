// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What run and masks do if the process that makes their masks dies or is silent.

#include <atomic>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/remote_peer.hpp"
#include "support/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

class ProgramRemote : public CopiedSceneTest<ProgramRemote> {
 public:
  static constexpr const char* synth_options = "--frames 6 --width 160 --height 120";

 protected:
  fs::path out(const std::string& name) const { return folder_ / name; }

  std::string with_peer() const { return " --remote " + quoted(out("socket")); }
  std::string run_into(const std::string& name) const {
    return "run " + quoted(scene()) + " --overlays 0 --out " + quoted(out(name));
  }

  bool answer(const PeerSocket& socket, const ReceivedFrame& frame) {
    FrameView view;
    view.id = frame.id;
    view.timestamp_s = frame.timestamp_s;
    view.image = frame.image;
    return socket.send(reply(frame.request, MaskFolderSegmenter(scene() / "masks").segment(view)));
  }
};

TEST_F(ProgramRemote, SurviveADeathWithinAFrame) {
  std::atomic<int> asked{0};
  const RemotePeer peer(out("socket"), [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    return ++asked % 4 != 0 && answer(socket, frame);
  });
  const std::string patient = with_peer() + " --remote-timeout 30";
  const Outcome made = run("masks " + quoted(scene()) + patient + " --out " + quoted(out("made")));
  ASSERT_EQ(made.exit_code, 0) << made.printed;
  EXPECT_EQ(file_text(out("made") / "instances.csv"),
            file_text(scene() / "masks" / "instances.csv"));
  ASSERT_EQ(run(run_into("own")).exit_code, 0);
  const Outcome outcome = run(run_into("remote") + patient);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_EQ(file_text(out("remote") / "frames.csv"), file_text(out("own") / "frames.csv"));
}

TEST_F(ProgramRemote, SayThatNothingWasWritten) {
  const RemotePeer peer(out("socket"), [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    return frame.id != 3 && answer(socket, frame);
  });
  const Outcome made =
      run("masks " + quoted(scene()) + with_peer() + " --out " + quoted(out("made")));
  EXPECT_EQ(made.exit_code, 1);
  EXPECT_TRUE(made.mentions("(nothing was written; 3 of 6 frames had masks)")) << made.printed;
  EXPECT_FALSE(fs::exists(out("made")));
  const Outcome outcome = run(run_into("result") + with_peer());
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(outcome.mentions("(nothing was written; 3 of 6 frames had masks)"))
      << outcome.printed;
  EXPECT_FALSE(fs::exists(out("result")));
}

TEST_F(ProgramRemote, RefuseMasksThatTheyWouldNotUse) {
  const Outcome outcome = run(run_into("result") + with_peer() + " --masks elsewhere");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(outcome.mentions("excludes --remote")) << outcome.printed;
}

}  // namespace
}  // namespace dynfilter::testing
