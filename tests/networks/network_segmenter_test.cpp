// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/networks/network_segmenter.hpp"

#include <future>
#include <iostream>
#include <opencv2/core/version.hpp>
#include <opencv2/dnn/layer.hpp>

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "models.hpp"
#include "support/scene_images.hpp"
#include "support/test.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;
using testing::black_image;
using testing::blue;
using testing::blue_class;
using testing::expect_failure;
using testing::expect_misuse;
using testing::frame_of;
using testing::Models;
using testing::red;
using testing::red_class;

constexpr bool runs_stock_yolo = CV_VERSION_MAJOR > 4 ||
                                 (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7);

/// Expects a mask that fills exactly a rectangle, except that interpolation may round off its
/// corners.
void expect_block(const Instance& instance, const cv::Rect& rectangle, int corner_px = 4) {
  EXPECT_EQ(cv::Rect(instance.mask_origin, instance.mask.size()), rectangle);
  for (int y = 0; y < instance.mask.rows; ++y) {
    for (int x = 0; x < instance.mask.cols; ++x) {
      const int from_side = std::min(x, instance.mask.cols - 1 - x);
      const int from_top = std::min(y, instance.mask.rows - 1 - y);
      if (from_side + from_top < corner_px) continue;
      ASSERT_EQ(instance.mask.at<std::uint8_t>(y, x), 255) << x << ' ' << y;
    }
  }
}

class NetworkSegmenterTest : public Models {
 protected:
  static Segmentation segment(const std::string& name, const cv::Mat& image,
                              const NetworkOptions& options = {}) {
    return NetworkSegmenter(model(name), options).segment(frame_of(image));
  }

  /// A red block in the upper right cell of 32x32 pixels, a blue one in the lower left.
  static cv::Mat two_blocks() {
    cv::Mat image = black_image({64, 64});
    image(cv::Rect(32, 0, 32, 32)).setTo(red);
    image(cv::Rect(0, 32, 32, 32)).setTo(blue);
    return image;
  }

  static void expect_two_blocks(const Segmentation& found) {
    EXPECT_EQ(found.frame_id, 5U);
    EXPECT_EQ(found.timestamp_s, 2.5);
    EXPECT_EQ(found.image_size, cv::Size(64, 64));
    ASSERT_EQ(found.instances.size(), 2U);
    for (const Instance& instance : found.instances) {
      const cv::Rect block =
          instance.class_id == red_class ? cv::Rect(32, 0, 32, 32) : cv::Rect(0, 32, 32, 32);
      EXPECT_EQ(instance.box, block);
      expect_block(instance, block);
      EXPECT_GT(instance.score, 0.999F);
      EXPECT_FALSE(instance.track_id);
    }
    EXPECT_NE(found.instances[0].class_id, found.instances[1].class_id);
  }
};

// --- Every kind of model -------------------------------------------------------------------------

TEST_F(NetworkSegmenterTest, FindsTheBlocksInTheImage) {
  // The size of yolo_dynamic is in what its exporter wrote beside it.
  for (const char* name : {"yolo_raw", "yolo_dynamic", "yolact", "yolact_logits"}) {
    SCOPED_TRACE(name);
    expect_two_blocks(segment(name, two_blocks()));
  }
}

TEST_F(NetworkSegmenterTest, RunsDeformableConvolutionsOfYolactPlus) {
  for (const char* name : {"yolact_plus", "yolact_plus_onnx", "yolact_plus_mmcv"}) {
    SCOPED_TRACE(name);
    const Segmentation found = segment(name, two_blocks());  // read 32 pixels to the right
    ASSERT_EQ(found.instances.size(), 1U);
    EXPECT_EQ(found.instances[0].class_id, red_class);
    EXPECT_EQ(found.instances[0].box, cv::Rect(0, 0, 32, 32));
    EXPECT_NEAR(cv::countNonZero(found.instances[0].mask), 32 * 32, 32);
  }
  cv::dnn::LayerParams params;
  EXPECT_FALSE(cv::dnn::LayerFactory::createLayerInstance("DCNv2", params))
      << "OpenCV knows the layer while a model is loaded";
}

TEST_F(NetworkSegmenterTest, LoadsInManyThreadsAtOnce) {
  std::vector<std::future<Segmentation>> found;
  for (int i = 0; i < 16; ++i) {
    found.push_back(std::async(std::launch::async, [] { return segment("yolact", two_blocks()); }));
  }
  for (std::future<Segmentation>& result : found) expect_two_blocks(result.get());
}

TEST_F(NetworkSegmenterTest, KnowsItsClasses) {
  const NetworkSegmenter yolo(model("yolo_raw"));
  EXPECT_EQ(yolo.class_names(), (std::vector<std::string>{"red", "blue"}));
  EXPECT_EQ(yolo.class_id("blue"), std::optional<int>(1));
  EXPECT_FALSE(yolo.class_id("person"));
  EXPECT_EQ(yolo.input_size(), cv::Size(64, 64));
  EXPECT_TRUE(NetworkSegmenter(model("yolact")).class_names().empty());
  EXPECT_EQ(NetworkSegmenter(model("segformer")).class_id("car"), std::optional<int>(2));
  EXPECT_TRUE(NetworkSegmenter(model("semantic_7")).class_names().empty());
}

TEST_F(NetworkSegmenterTest, FindsOnlyTheWantedClasses) {
  NetworkOptions options;
  options.classes = {blue_class};
  for (const char* name : {"yolo_raw", "yolact"}) {
    const Segmentation found = segment(name, two_blocks(), options);
    ASSERT_EQ(found.instances.size(), 1U) << name;
    EXPECT_EQ(found.instances[0].class_id, blue_class);
  }
}

TEST_F(NetworkSegmenterTest, ServesFrameAfterFrame) {
  NetworkSegmenter first(model("yolo_raw"));
  NetworkSegmenter network = std::move(first);
  for (int trial = 0; trial < 3; ++trial) {
    expect_two_blocks(network.segment(frame_of(two_blocks())));
    EXPECT_TRUE(network.segment(frame_of(black_image({31, 77}))).instances.empty());
  }
}

TEST_F(NetworkSegmenterTest, KeepsTheImageUnchangedAndAcceptsGrey) {
  cv::Mat image(64, 64, CV_8UC1, cv::Scalar(0));
  image(cv::Rect(32, 0, 32, 32)).setTo(255);
  const cv::Mat before = image.clone();
  segment("yolact", image);
  EXPECT_EQ(cv::norm(image, before, cv::NORM_INF), 0);
  const Segmentation found = segment("yolo_raw", image);  // white contains red and blue
  ASSERT_EQ(found.instances.size(), 1U);
  EXPECT_EQ(found.instances[0].class_id, red_class);
  EXPECT_EQ(found.instances[0].box, cv::Rect(32, 0, 32, 32));
}

TEST_F(NetworkSegmenterTest, RefusesFramesWithoutAColorOrGreyImage) {
  NetworkSegmenter network(model("yolo_raw"));
  expect_misuse([&] { network.segment(frame_of(cv::Mat())); }, "a frame without an image");
  expect_misuse([&] { network.segment(frame_of(cv::Mat(8, 8, CV_8UC4))); }, "CV_8UC4");
  expect_misuse([&] { network.segment(frame_of(cv::Mat(8, 8, CV_16UC1))); }, "CV_16UC1");
}

// --- Semantic networks ---------------------------------------------------------------------------

TEST_F(NetworkSegmenterTest, FindsTheConnectedPartsOfPersons) {
  cv::Mat image = black_image({128, 64});  // stretched to 64x64
  image(cv::Rect(64, 0, 64, 32)).setTo(red);
  image(cv::Rect(0, 32, 32, 32)).setTo(red);
  for (const char* name : {"selfie", "selfie_logits", "sinet", "human_seg", "segnet", "segformer",
                           "segformer_150", "deeplab"}) {
    SCOPED_TRACE(name);
    const Segmentation found = segment(name, image);
    ASSERT_EQ(found.instances.size(), 2U);
    EXPECT_GE(found.instances[0].score, found.instances[1].score);
    for (const Instance& instance : found.instances) {
      const bool is_wide = instance.mask.cols == 64;
      EXPECT_EQ(instance.class_id, 0);
      EXPECT_GT(instance.score, 0.8F);
      expect_block(instance, is_wide ? cv::Rect(64, 0, 64, 32) : cv::Rect(0, 32, 32, 32), 8);
      EXPECT_EQ(instance.box, is_wide ? cv::Rect(44, 0, 84, 52) : cv::Rect(0, 12, 52, 52));
    }
  }
}

TEST_F(NetworkSegmenterTest, SemanticNetworksWithUnknownClassesCountChannels) {
  NetworkOptions options;
  for (const std::vector<int>& classes : {std::vector<int>(), {3}}) {
    options.classes = classes;
    const Segmentation found = segment("semantic_7", two_blocks(), options);
    ASSERT_EQ(found.instances.size(), 1U);
    EXPECT_EQ(found.instances[0].class_id, 3);
  }
  options.classes = {2};
  EXPECT_TRUE(segment("semantic_7", two_blocks(), options).instances.empty());
  options.classes = {0};
  expect_misuse([&] { NetworkSegmenter(model("semantic_7"), options); },
                "class 0 in classes; want one that ");
}

TEST_F(NetworkSegmenterTest, HalfPrecisionRunsOrNamesTheExportOption) {
  try {
    EXPECT_EQ(segment("deeplab_half", two_blocks()).instances.size(), 1U);
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("export it with half=False"), std::string::npos)
        << error.what();
  }
}

/// 75x67 pixels have 18x16 whole cells.
TEST_F(NetworkSegmenterTest, SemanticNetworksMayHaveAnOddSize) {
  cv::Mat image = black_image({300, 268});
  image(cv::Rect(100, 0, 100, 268)).setTo(red);
  const Segmentation found = segment("odd_size", image);
  ASSERT_EQ(found.instances.size(), 1U);
  const Instance& instance = found.instances[0];
  EXPECT_NEAR(instance.mask_origin.x, 100, 8);
  EXPECT_NEAR(instance.mask_origin.x + instance.mask.cols, 200, 8);
  EXPECT_EQ(instance.mask.rows, 268);
}

// --- YOLO ----------------------------------------------------------------------------------------

TEST_F(NetworkSegmenterTest, UndoesLetterboxing) {
  // 128x64 becomes 64x32 between borders of 16 rows. A block that fills the cell at (32, 32) of the
  // input is in the lower right: columns 64 to 127; rows 32 on, of which 32 are in the image.
  cv::Mat image = black_image({128, 64});
  image(cv::Rect(64, 32, 64, 32)).setTo(red);
  const Segmentation found = segment("yolo_raw", image);
  ASSERT_EQ(found.instances.size(), 1U);
  EXPECT_EQ(found.instances[0].box, cv::Rect(64, 32, 64, 32));
  expect_block(found.instances[0], {64, 32, 64, 32});
}

TEST_F(NetworkSegmenterTest, UsesTheInputSizeOptionForDynamicModels) {
  NetworkOptions options;
  options.input_size = {64, 64};
  expect_two_blocks(segment("yolo_open_size", two_blocks(), options));
  options.input_size = {128, 64};
  EXPECT_EQ(NetworkSegmenter(model("yolo_open_size"), options).input_size(), cv::Size(128, 64));
  const Segmentation found =
      segment("yolo_open_size", two_blocks(), options);  // 32 columns of border
  ASSERT_EQ(found.instances.size(), 2U);
  expect_block(found.instances[0], found.instances[0].box);
}

TEST_F(NetworkSegmenterTest, AcceptsObjectnessAndPaddedRows) {
  for (const char* name : {"yolo_v5", "yolo_padded"}) {
    SCOPED_TRACE(name);
    const Segmentation found = segment(name, two_blocks());
    ASSERT_EQ(found.instances.size(), 1U);
    EXPECT_EQ(found.instances[0].class_id, red_class);
    EXPECT_FLOAT_EQ(found.instances[0].score, 0.5F);
    expect_block(found.instances[0], {32, 0, 32, 32});
  }
}

TEST_F(NetworkSegmenterTest, AcceptsEndToEndModels) {
  cv::Mat image = two_blocks();
  image(cv::Rect(0, 0, 16, 32)).setTo(red);
  const Segmentation found = segment("yolo_end_to_end", image);
  ASSERT_EQ(found.instances.size(), 2U);
  EXPECT_EQ(found.instances[0].class_id, red_class);
  EXPECT_FLOAT_EQ(found.instances[0].score, 0.75F);
  expect_block(found.instances[0], {32, 0, 32, 32});
  EXPECT_EQ(found.instances[1].class_id, blue_class);
  EXPECT_EQ(found.instances[1].box, cv::Rect(0, 0, 32, 32));
  expect_block(found.instances[1], {0, 0, 16, 32});
  // Boxes without a mask give no instance.
  EXPECT_TRUE(segment("yolo_end_to_end", black_image({64, 64})).instances.empty());
}

TEST_F(NetworkSegmenterTest, DetectorsGiveBoxesAlone) {
  for (const char* name :
       {"yolo_detector", "yolo_detector_v5", "yolo_detector_v6", "yolo_detector_end_to_end"}) {
    SCOPED_TRACE(name);
    const Segmentation found = segment(name, black_image({128, 128}));
    ASSERT_EQ(found.instances.size(), 2U);
    EXPECT_EQ(found.instances[0].class_id, red_class);
    EXPECT_FLOAT_EQ(found.instances[0].score, 0.75F);
    EXPECT_EQ(found.instances[0].box, cv::Rect(64, 0, 64, 64));
    EXPECT_EQ(found.instances[1].box, cv::Rect(0, 0, 64, 64));
    for (const Instance& instance : found.instances) EXPECT_TRUE(instance.mask.empty());
  }
}

TEST_F(NetworkSegmenterTest, StockModelsRunOrNameTheRemedy) {
  for (const char* name : {"yolo_stock", "yolo_stock_13", "yolo_stock_boxes"}) {
    SCOPED_TRACE(name);
    if (runs_stock_yolo) {
      const Segmentation found = segment(name, two_blocks());
      EXPECT_EQ(found.instances.size(), 2U);
      if (std::string(name) != "yolo_stock_boxes") expect_two_blocks(found);
      continue;
    }
    for (const std::string& part :
         {name + std::string(".onnx: OpenCV"), std::string("needs OpenCV 4.7 or newer"),
          std::string("examples/cut_yolo_heads.py")}) {
      expect_failure([&] { NetworkSegmenter{model(name)}; }, part);
    }
  }
}

TEST_F(NetworkSegmenterTest, StockModelsRunAfterCutting) {
  for (const char* name : {"yolo_stock", "yolo_stock_13"}) {
    SCOPED_TRACE(name);
    const fs::path cut = folder() / (std::string(name) + "_cut.onnx");
    ASSERT_TRUE(fs::exists(cut));
    NetworkSegmenter network(cut);
    expect_two_blocks(network.segment(frame_of(two_blocks())));
    EXPECT_EQ(network.class_names(), (std::vector<std::string>{"red", "blue"}));
  }
  NetworkSegmenter boxes(folder() / "yolo_stock_boxes_cut.onnx");
  const Segmentation found = boxes.segment(frame_of(two_blocks()));
  ASSERT_EQ(found.instances.size(), 2U);
  for (const Instance& instance : found.instances) {
    EXPECT_EQ(instance.box,
              instance.class_id == red_class ? cv::Rect(32, 0, 32, 32) : cv::Rect(0, 32, 32, 32));
    EXPECT_TRUE(instance.mask.empty());
  }
}

// --- YOLACT --------------------------------------------------------------------------------------

TEST_F(NetworkSegmenterTest, YolactStretchesTheImage) {
  cv::Mat image = black_image({128, 32});
  image(cv::Rect(64, 0, 64, 16)).setTo(red);
  const Segmentation found = segment("yolact", image);
  ASSERT_EQ(found.instances.size(), 1U);
  EXPECT_EQ(found.instances[0].box, cv::Rect(64, 0, 64, 16));
  expect_block(found.instances[0], {64, 0, 64, 16});
}

TEST_F(NetworkSegmenterTest, YolactReadsPriorsFromTheModel) {
  // All priors lie at (0.25, 0.75) with half the usual size: 16x16 around (16, 48).
  const Segmentation from_model = segment("yolact_priors", two_blocks());
  ASSERT_EQ(from_model.instances.size(), 1U);  // the red block has no mask there
  EXPECT_EQ(from_model.instances[0].class_id, blue_class);
  EXPECT_EQ(from_model.instances[0].box, cv::Rect(8, 40, 16, 16));
}

// --- A real network, compared with masks that another program made with the same weights ---------

constexpr const char* sequence = "tum_fr3_walking_halfsphere_50";
constexpr int person = 0;

class SlowRecordedPeople : public testing::RecordedData {
 protected:
  void SetUp() override {
    RecordedData::SetUp();
    if (IsSkipped()) return;
    model_ = data(sequence).parent_path().parent_path() / "models" / "yolov8n-seg-raw-heads.onnx";
    if (!fs::exists(model_)) GTEST_SKIP() << "DYNFILTER_DATA_DIR has no " << model_;
  }

  fs::path model_;
};

cv::Mat people_in(Segmentation segmentation) {
  auto& all = segmentation.instances;
  all.erase(std::remove_if(all.begin(), all.end(),
                           [](const Instance& one) { return one.class_id != person; }),
            all.end());
  return testing::painted(segmentation);
}

double intersection_over_union(const cv::Mat& a, const cv::Mat& b) {
  return cv::countNonZero(a & b) / static_cast<double>(std::max(cv::countNonZero(a | b), 1));
}

TEST_F(SlowRecordedPeople, MatchTheMasksOfAnotherProgram) {
  NetworkOptions options;
  options.classes = {person};
  NetworkSegmenter people(model_, options);
  EXPECT_EQ(people.class_names().at(person), "person");
  EXPECT_EQ(people.input_size(), cv::Size(640, 640));

  MaskFolderSegmenter theirs(data(sequence) / "masks");
  double sum = 0;
  double worst = 1;
  std::size_t frames = 0;
  for (const auto& entry : fs::directory_iterator(data(sequence) / "rgb")) {
    FrameView frame;
    frame.timestamp_s = std::stod(entry.path().stem());
    if (!theirs.has_mask(frame.timestamp_s)) continue;  // only 50 frames have masks
    frame.image = cv::imread(entry.path().string());
    const Segmentation found = people.segment(frame);
    EXPECT_FALSE(found.instances.empty()) << entry.path();
    const double iou = intersection_over_union(people_in(found), people_in(theirs.segment(frame)));
    sum += iou;
    worst = std::min(worst, iou);
    ++frames;
  }
  ASSERT_EQ(frames, 49U);
  std::cout << frames << " frames, mean IoU " << sum / static_cast<double>(frames) << ", worst "
            << worst << '\n';
  EXPECT_GE(sum / static_cast<double>(frames), 0.95);
}

}  // namespace
}  // namespace dynfilter
