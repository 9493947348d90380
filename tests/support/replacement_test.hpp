// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_REPLACEMENT_TEST_HPP
#define DYNFILTER_TESTS_SUPPORT_REPLACEMENT_TEST_HPP

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/file_tree.hpp"
#include "support/program.hpp"
#include "support/remote_peer.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {

/// Sub-command that replaces its own results by others.
struct Replacement {
  std::string name;
  std::string earlier, later;                    ///< arguments except the folder
  std::function<bool(const fs::path&)> is_read;  ///< whether a reader accepts the folder
};

/// Removes run times from the summary.
inline FileTree without_times(FileTree files) {
  const auto summary = files.find("summary.json");
  if (summary == files.end()) return files;
  nlohmann::json json = nlohmann::json::parse(summary->second);
  json.erase("times_ms");
  summary->second = json.dump();
  return files;
}

template <class Read>
bool succeeds(const Read& read) {
  try {
    read();
    return true;
  } catch (const std::runtime_error&) {
    return false;
  }
}

/// Makes a small scene and a process that gives its masks.
class ReplacementTest : public ::testing::Test {
 protected:
  ReplacementTest() {
    const Outcome synth =
        run("synth " + quoted(folder_ / "scene") + " --frames 4 --width 160 --height 120");
    if (synth.exit_code != 0) throw std::runtime_error(synth.printed);
    masks_ = std::make_unique<MaskFolderSegmenter>(folder_ / "scene/masks");
    peer_ = std::make_unique<RemotePeer>(
        folder_ / "socket", [this](const PeerSocket& socket, const ReceivedFrame& frame) {
          FrameView view;
          view.id = frame.id;
          view.timestamp_s = frame.timestamp_s;
          view.image = frame.image;
          return socket.send(reply(frame.request, masks_->segment(view)));
        });
  }

  std::vector<Replacement> replacements() const {
    const std::string scene = quoted(folder_ / "scene");
    const std::string masks = "masks --overwrite --remote " + quoted(folder_ / "socket") + " ";
    // Without one frame the sequence has other masks.
    const fs::path shorter = folder_ / "shorter";
    fs::create_directories(shorter);
    for (const char* name : {"camera.yaml", "rgb", "depth"}) {
      fs::copy(folder_ / "scene" / name, shorter / name, fs::copy_options::recursive);
    }
    std::string rows = file_text(folder_ / "scene/associations.txt");
    rows.erase(0, rows.find('\n') + 1);
    folder_.write("shorter/associations.txt", rows);
    return {
        {"run", "run --features 200 --overlays 3 " + scene + " --out ",
         "run --features 300 --overlays 2 " + scene + " --out ",
         [](const fs::path& out) { return fs::exists(out / "summary.json"); }},
        {"masks", masks + scene + " --out ", masks + quoted(shorter) + " --out ",
         [](const fs::path& out) { return succeeds([&] { MaskFolderSegmenter{out}; }); }},
        {"synth", "synth --overwrite --frames 3 --width 64 --height 48 ",
         "synth --overwrite --frames 2 --width 96 --height 48 ",
         [](const fs::path& out) { return succeeds([&] { RgbdSequence{out}; }); }}};
  }

  static FileTree made(const std::string& arguments, const fs::path& out) {
    const Outcome outcome = run(arguments + quoted(out));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
    return without_times(visible_tree(out));
  }

  TemporaryFolder folder_;

 private:
  std::unique_ptr<MaskFolderSegmenter> masks_;
  std::unique_ptr<RemotePeer> peer_;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_REPLACEMENT_TEST_HPP
