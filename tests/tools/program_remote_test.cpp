// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What run and masks do if the process that makes their masks dies or is silent.

#include <sys/wait.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/program.hpp"
#include "support/remote_peer.hpp"
#include "support/small_scene_test.hpp"
#include "support/started_program.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

constexpr int frames = 6;

class ProgramRemote : public ::testing::Test {
 protected:
  ProgramRemote() {
    const Outcome synth = run("synth " + quoted(scene()) + " --width 160 --height 120 --frames " +
                              std::to_string(frames));
    EXPECT_EQ(synth.exit_code, 0) << synth.printed;
    masks_ = std::make_unique<MaskFolderSegmenter>(scene() / "masks");
  }

  fs::path scene() const { return folder_ / "scene"; }
  fs::path out(const std::string& name) const { return folder_ / name; }

  /// Peer that hangs up instead of answering each `period`-th request.
  RemotePeer peer_that_fails_each(int period) {
    return {out("socket"), [this, period](const PeerSocket& socket, const ReceivedFrame& frame) {
              return ++asked_ % period != 0 && answer(socket, frame);
            }};
  }

  /// Peer that hangs up whenever it gets this frame.
  RemotePeer peer_that_fails_at(std::uint64_t id) {
    return {out("socket"), [this, id](const PeerSocket& socket, const ReceivedFrame& frame) {
              return frame.id != id && answer(socket, frame);
            }};
  }

  std::string with_peer() const { return " --remote " + quoted(out("socket")); }
  std::string run_into(const std::string& name) const {
    return "run " + quoted(scene()) + " --overlays 0 --out " + quoted(out(name));
  }

  bool answer(const PeerSocket& socket, const ReceivedFrame& frame) {
    FrameView view;
    view.id = frame.id;
    view.timestamp_s = frame.timestamp_s;
    view.image = frame.image;
    return socket.send(reply(frame.request, masks_->segment(view)));
  }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<MaskFolderSegmenter> masks_;
  std::atomic<int> asked_{0};
};

TEST_F(ProgramRemote, SurviveADeathWithinAFrame) {
  const RemotePeer peer = peer_that_fails_each(4);
  const std::string patient = with_peer() + " --remote-timeout 30";
  const Outcome made = run("masks " + quoted(scene()) + patient + " --out " + quoted(out("made")));
  ASSERT_EQ(made.exit_code, 0) << made.printed;
  EXPECT_EQ(read_text(out("made") / "instances.csv"),
            read_text(scene() / "masks" / "instances.csv"));
  ASSERT_EQ(run(run_into("own")).exit_code, 0);
  const Outcome outcome = run(run_into("remote") + patient);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_EQ(read_text(out("remote") / "frames.csv"), read_text(out("own") / "frames.csv"));
}

TEST_F(ProgramRemote, SayThatNothingWasWritten) {
  const RemotePeer peer = peer_that_fails_at(3);
  const Outcome made =
      run("masks " + quoted(scene()) + with_peer() + " --out " + quoted(out("made")));
  EXPECT_EQ(made.exit_code, 1);
  EXPECT_TRUE(made.mentions("(nothing was written; 3 of 6 frames had masks)")) << made.printed;
  EXPECT_FALSE(fs::exists(out("made")));
  const Outcome outcome = run(run_into("result") + with_peer());
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(outcome.mentions("(nothing was written; --async goes on without)"))
      << outcome.printed;
  EXPECT_FALSE(fs::exists(out("result") / "frames.csv"));
}

TEST_F(ProgramRemote, RunWithAThreadGoesOnWithoutMasks) {
  const RemotePeer peer = peer_that_fails_at(3);
  const Outcome outcome = run(run_into("result") + with_peer() + " --async wait");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("frames without masks, because the segmenter failed: 1, the first"))
      << outcome.printed;
  EXPECT_TRUE(outcome.mentions("masks made in a thread: ")) << outcome.printed;
  EXPECT_EQ(read_csv(out("result") / "frames.csv").size(), 1U + frames);
}

TEST_F(ProgramRemote, DoNotNeedTheMasksOfTheSequence) {
  const RemotePeer peer = peer_that_fails_each(1000);
  fs::copy(scene(), out("other"), fs::copy_options::recursive);
  for (const auto& mask : fs::directory_iterator(out("other") / "masks")) {
    if (mask.path().extension() == ".png") fs::resize_file(mask.path(), 20);
  }
  const Outcome outcome = run("run " + quoted(out("other")) + " --overlays 0 --out " +
                              quoted(out("result")) + with_peer());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
}

TEST_F(ProgramRemote, RefuseMasksThatTheyWouldNotUse) {
  for (const char* masks : {" --masks elsewhere", " --degrade eroded"}) {
    const Outcome outcome = run(run_into("result") + with_peer() + masks);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_TRUE(outcome.mentions("excludes --remote")) << outcome.printed;
    EXPECT_FALSE(fs::exists(out("result")));
  }
}

TEST_F(ProgramRemote, CtrlCEndsTheWaitForMasks) {
  std::atomic<int> asked{0};
  std::atomic<bool> answers{false};
  const RemotePeer peer(out("socket"), [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    ++asked;
    return !answers || answer(socket, frame);
  });
  const std::string silent = with_peer() + " --remote-timeout 600";
  struct Call {
    std::string arguments;
    bool is_answered;  // at once; the program itself waits
  };
  const Call calls[] = {
      {run_into("out") + silent, false},
      {run_into("out") + silent + " --async wait", false},
      {run_into("out") + silent + " --async latest", false},
      {"masks " + quoted(scene()) + silent + " --out " + quoted(out("out")), false}};
  for (const Call& call : calls) {
    SCOPED_TRACE(call.arguments);
    asked = 0;
    answers = call.is_answered;
    const Started program(call.arguments, out("printed"));
    while (asked == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    program.send(SIGINT);
    const std::optional<int> status = program.wait_at_most(std::chrono::seconds(30));
    ASSERT_TRUE(status) << "it went on waiting";
    EXPECT_TRUE(WIFSIGNALED(*status) && WTERMSIG(*status) == SIGINT) << program.printed();
    EXPECT_NE(program.printed().find("interrupted: each folder"), std::string::npos)
        << program.printed();
    EXPECT_TRUE(!fs::exists(out("out")) || fs::is_empty(out("out"))) << "something is left";
  }
}

}  // namespace
}  // namespace dynfilter::testing
