// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// RemoteSegmenter with the page that an owner of a network copies, examples/remote_masks.

#include <sys/stat.h>

#include <future>

#include "dynfilter/remote/remote_segmenter.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

const std::string python = DYNFILTER_PYTHON;
const std::string page = DYNFILTER_SOURCE_DIR "/examples/remote_masks/";

/// A network of the page: it does what the first pixel says, or finds bright objects.
const std::string network = "import socket, sys, zmq\nsys.path.insert(0, '" + page + R"(')
import numpy as np, remote_masks
class Network(remote_masks.Segmenter):
    def segment(self, image):
        half = np.full((2, 1, 20, 30), 0.4, np.float32)
        half[1, 0, 3:5, 2:8] = 0.6
        does = [lambda: dict(boxes=[[1.5, 2, 9.2, 8]], scores=np.float32([0.5]), class_ids=[56.0]),
                lambda: dict(masks=half, track_ids=np.int64([4, 5])), lambda: {}, lambda: None,
                lambda: dict(masks=[np.ones((3, 3))]), lambda: dict(boxes=[[1, 2, 3]]),
                lambda: dict(boxes=[[1, 2, 3, float('nan')]]), lambda: dict(boxes=[], scores=[1]),
                lambda: 1 / 0, lambda: sys.exit('no memory'), lambda: dict(boxes=[[9, 2, 3, 4]]),
                lambda: dict(masks=[np.eye(*image.shape[:2], dtype=bool)] * 3)]
        what = image.flat[0] if image.ndim == 3 else 255
        return does[what]() if what < len(does) else super().segment(image)
)";

class RemotePage : public ::testing::Test {
 protected:
  void SetUp() override {
    if (python.empty()) GTEST_SKIP() << "CMake found no python3 with NumPy and PyZMQ";
    people.emplace(path, until_python_listens);
  }

  const RemoteSegmenterOptions until_python_listens{120, 0.01};

  std::vector<Instance> found(int first_pixel, int type = CV_8UC3, cv::Size size = {30, 20}) {
    FrameView frame;
    frame.image = cv::Mat(size, type, cv::Scalar::all(first_pixel));
    return people->segment(frame).instances;
  }

  /// Starts Python, with the socket's path as argument. `running` ends it.
  void start(const std::string& code) {
    const std::string file = folder / "script.py";
    folder.write("script.py", network + code);
    running.emplace_back(std::make_unique<ChildProcess>(
        [&] { execl(python.c_str(), python.c_str(), "-B", file.c_str(), path.c_str(), nullptr); }));
  }

  TemporaryFolder folder;
  std::string path = folder / "masks.sock";
  std::optional<RemoteSegmenter> people;
  std::vector<std::unique_ptr<ChildProcess>> running;
  const std::string serve = "remote_masks.serve(sys.argv[1], Network())\n";
};

TEST_F(RemotePage, ServesWhateverTheNetworkDoes) {
  start(serve);
  const char* const says[] = {"neither masks nor boxes", "NoneType",
                              "a mask of shape (3, 3)",  "cannot reshape",
                              "not JSON compliant",      "a score for 1 of 0 objects",
                              "ZeroDivisionError",       "SystemExit: no memory",
                              "malformed reply: box"};
  for (std::size_t i = 0; i < std::size(says); ++i) {
    expect_failure([&] { found(static_cast<int>(i) + 2); }, says[i]);
    const Instance box = found(0).at(0);
    EXPECT_EQ(box.box, cv::Rect(1, 2, 9, 6)) << "the smallest of whole pixels";
    EXPECT_TRUE(box.mask.empty() && box.class_id == 56 && box.score == 0.5F);
  }
  expect_failure([&] { found(11, CV_8UC3, {4800, 4800}); }, "masks of 69120000 bytes");
  const std::vector<Instance> masks = found(1);
  EXPECT_TRUE(masks.at(0).mask.empty() && masks[0].track_id == 4 && masks[1].score == 1);
  EXPECT_EQ(masks.at(1).box, cv::Rect(2, 3, 6, 2));
  EXPECT_EQ(cv::countNonZero(masks[1].mask), 12);
  struct stat entry {};
  ASSERT_EQ(stat(path.c_str(), &entry), 0);
  EXPECT_EQ(entry.st_mode & 0777U, 0600U) << "no other user may connect";
  running.back()->stop(SIGKILL);  // leaves its socket, which the next process replaces
  start("sys.argv[1] = 'ipc://' + sys.argv[1]\n" + serve);
  for (const int type : {CV_8UC1, CV_8UC3}) EXPECT_EQ(found(200, type).at(0).mask.total(), 600U);
  EXPECT_TRUE(found(100).empty());
}

TEST_F(RemotePage, ManyHostsGetTheirMasksBesideHalfOpenOnes) {
  start(serve);
  found(200);
  // Connections that send nothing, a part of their first message, or requests but read no reply.
  start(R"(
held = []
for k in range(40):
    held += [socket.socket(socket.AF_UNIX), zmq.Context.instance().socket(zmq.DEALER)]
    held[-2].connect(sys.argv[1])
    held[-2].send(b'\xff\0\0\0\0\0\0\0\1\x7f\3'[:k % 12])
    held[-1].connect('ipc://' + sys.argv[1])
    held[-1].send_multipart([b'', b'{}'])
open(sys.argv[1] + '.done', 'w')
zmq.Context.instance().socket(zmq.PAIR).recv()
)");
  while (!std::filesystem::exists(path + ".done")) found(200);
  std::vector<std::future<void>> hosts;
  for (int host = 1; host <= 20; ++host) {
    hosts.push_back(std::async(std::launch::async, [&, host] {
      RemoteSegmenter own(path, until_python_listens);
      FrameView frame;
      frame.image = cv::Mat(30, 30, CV_8UC1, cv::Scalar(0));
      frame.image({0, 0, host, host}).setTo(255);
      for (int i = 0; i < 9; ++i) EXPECT_EQ(own.segment(frame).instances.at(0).box.width, host);
    }));
  }
  for (auto& host : hosts) host.get();
}

TEST_F(RemotePage, RefusesAPlaceThatOthersCouldTake) {
  const std::string run = "'" + python + "' -B '" + page + "remote_masks.py' '" + path + "' 2>&1";
  const auto expect_refused = [&](const char* part) {
    EXPECT_EQ(std::system((run + " | grep -q '" + part + "'").c_str()), 0) << part;
  };
  chmod(folder.path().c_str(), 0777);
  expect_refused("other users may write to its folder");
  chmod(folder.path().c_str(), 01777);
  folder.write("masks.sock", "mine");
  expect_refused("a process listens there, or it is no socket");
  EXPECT_TRUE(std::filesystem::remove(path));
  start(serve);
  found(200);
  expect_refused("a process listens there, or it is no socket");
  found(200);
}

}  // namespace
}  // namespace dynfilter::testing
