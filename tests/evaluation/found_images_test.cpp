// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Folders as cameras, phones and data sets leave them: which images are taken, and what is said.

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "evaluation/sequence_folder.hpp"
#include "io/frame_names.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;
using Files = std::vector<std::string>;

/// A file's name, before which stands what it holds: c colour, d depth, 8 a mask or grey of 8 bits.
void write_file(const TemporaryFolder& folder, const std::string& file) {
  const fs::path path = folder / file.substr(2);
  fs::create_directories(path.parent_path());
  const bool is_large = file.find("large") != std::string::npos;
  const cv::Size size = is_large ? cv::Size(1296, 968) : cv::Size(640, 480);
  const int type = file[0] == 'c' ? CV_8UC3 : file[0] == 'd' ? CV_16UC1 : CV_8UC1;
  if (file[0] == '-') {
    folder.write(file.substr(2), "bytes");
  } else {
    ASSERT_TRUE(cv::imwrite(path.string(), cv::Mat(size, type, cv::Scalar::all(100)))) << path;
  }
}

/// Reads names from a text: "c3:rgb/##.png" stands for three, from rgb/00.png to rgb/02.png.
Files files_of(const std::string& text) {
  Files files;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::size_t colon = word.find(':'), first = word.find('#');
    const std::size_t digits = first == word.npos ? 0 : word.rfind('#') + 1 - first;
    const int count = colon == 1 ? 1 : std::stoi(word.substr(1));
    for (int k = 0; k < count; ++k) {
      std::string number = std::to_string(k), file = word;
      number.insert(0, digits - std::min(digits, number.size()), '0');
      if (digits > 0) file.replace(first, digits, number);
      files.push_back(word[0] + file.substr(colon));
    }
  }
  return files;
}

struct Layout {
  const char* name;
  std::string files;
  std::string first;  // names of the first and the last frame's images: colour|depth
  std::string last;
  std::size_t frames;
  std::string note = "";  // part of it
  std::map<std::string, std::string> texts = {};
};

std::string names_of(const RgbdSequence& sequence, std::size_t i) {
  const auto inside = [&](const fs::path& file) {
    return file.empty() ? "" : file.lexically_relative(sequence.folder()).string();
  };
  return inside(sequence.entry(i).image_path) + "|" + inside(sequence.entry(i).depth_path);
}

std::vector<Layout> layouts() {
  return {
      {"Open3D's recorder", "c3:color/######.jpg d3:depth/######.png",
       "color/000000.jpg|depth/000000.png", "color/000002.jpg|depth/000002.png", 3,
       "3 colour images of color/, 3 depth images of depth/"},
      {"OpenLORIS",
       "c:color/1560000000.1.png c:color/1560000000.2.png d:aligned_depth/1560000000.1.png "
       "d:aligned_depth/1560000000.2.png",
       "color/1560000000.1.png|aligned_depth/1560000000.1.png",
       "color/1560000000.2.png|aligned_depth/1560000000.2.png",
       2,
       "",
       {{"color.txt",
         "1560000000.1 color/1560000000.1.png\n"
         "1560000000.2 color/1560000000.2.png\n"},
        {"aligned_depth.txt",
         "1560000000.1 aligned_depth/1560000000.1.png\n"
         "1560000000.2 aligned_depth/1560000000.2.png\n"}}},
      {"Replica", "c4:results/frame######.jpg d4:results/depth######.png",
       "results/frame000000.jpg|results/depth000000.png",
       "results/frame000003.jpg|results/depth000003.png", 4, "4 depth images of results/"},
      {"7-Scenes", "c3:frame-######.color.png d3:frame-######.depth.png -3:frame-######.pose.txt",
       "frame-000000.color.png|frame-000000.depth.png",
       "frame-000002.color.png|frame-000002.depth.png", 3},
      {"ScanNet", "c12:color/#.jpg d12:depth/#.png", "color/0.jpg|depth/0.png",
       "color/11.jpg|depth/11.png", 12},
      {"every tenth, depth of every twentieth",
       "c:color/0.jpg c:color/10.jpg c:color/20.jpg d:depth/20.png d:depth/0.png",
       "color/0.jpg|depth/0.png", "color/20.jpg|depth/20.png", 2},
      {"a phone", "c3:rgb/######.png d3:depth/######.png 83:confidence/######.png",
       "rgb/000000.png|depth/000000.png", "rgb/000002.png|depth/000002.png", 3},
      {"Polycam",
       "c3:keyframes/images/421532#.jpg d3:keyframes/depth/421532#.png "
       "83:keyframes/confidence/421532#.png",
       "keyframes/images/4215320.jpg|keyframes/depth/4215320.png",
       "keyframes/images/4215322.jpg|keyframes/depth/4215322.png", 3},
      {"SUN3D",
       "c:image/0000001-000000000000.jpg c:image/0000002-000000033369.jpg "
       "d:depth/0000001-000000000101.png d:depth/0000002-000000033471.png",
       "image/0000001-000000000000.jpg|depth/0000001-000000000101.png",
       "image/0000002-000000033369.jpg|depth/0000002-000000033471.png", 2},
      {"RealSense", "c2:color/#.png d2:aligned_depth_to_color/#.png d2:ir/#.png",
       "color/0.png|aligned_depth_to_color/0.png", "color/1.png|aligned_depth_to_color/1.png", 2},
      {"told apart by their pixels", "c2:cam/#_a.png d2:cam/#_b.png", "cam/0_a.png|cam/0_b.png",
       "cam/1_a.png|cam/1_b.png", 2},
      {"times in names, one image without depth",
       "c:rgb/1548339819.87.png c:rgb/1548339819.90.png c:rgb/1548339819.95.png "
       "d:depth/1548339819.88.png d:depth/1548339819.94.png",
       "rgb/1548339819.87.png|depth/1548339819.88.png",
       "rgb/1548339819.95.png|depth/1548339819.94.png", 2},
      {"TUM without depth.txt",
       "c:rgb/1.5.png c:rgb/2.5.png d:depth/1.51.png d:depth/2.51.png",
       "rgb/1.5.png|depth/1.51.png",
       "rgb/2.5.png|depth/2.51.png",
       2,
       "2 depth images of depth/",
       {{"rgb.txt", "1.5 rgb\\1.5.png\n2.5 rgb\\2.5.png\n"}}},
      {"ICL-NUIM",
       "c:rgb/0.png c:rgb/1.png d:depth/0.png d:depth/1.png",
       "rgb/0.png|depth/0.png",
       "rgb/1.png|depth/1.png",
       2,
       "",
       {{"associations.txt", "0.5 depth/0.png 0.5 rgb/0.png\n1.5 depth/1.png 1.5 rgb/1.png\n"}}},
      {"coloured depth", "c2:color/#.png c2:depth/#.png", "color/0.png|", "color/1.png|", 2,
       "2 images called depth have 8 bits, and are not used"},
      {"arrays of depth", "c2:color/#.png -:depth/0.npy", "color/0.png|", "color/1.png|", 2,
       "depth/0.npy is an array"},
      {"a rig", "c2:left/#.png c2:right/#.png", "left/0.png|", "right/1.png|", 4,
       "4 colour images of 2 folders, first left/"},
      {"depth of other numbers", "c2:color/#.png d:depth/7.png", "color/0.png|", "color/1.png|", 2,
       "which are not used: want"},
      {"thermal images alone", "d2:images/#.png", "images/0.png|", "images/1.png|", 2},
      {"a plain folder", "c11:#.jpg -:._3.jpg -:notes.txt", "0.jpg|", "10.jpg|", 11,
       "11 colour images of "},
      {"labels beside images",
       "c2:JPEGImages/#.jpg 82:SegmentationClass/#.png 82:labels/#.png 82:mask/#.png "
       "c2:semantic/#.png",
       "JPEGImages/0.jpg|", "JPEGImages/1.jpg|", 2},
      {"masks in the same folder", "c2:#.jpg 82:#_mask.png", "0.jpg|", "1.jpg|", 2},
      {"smaller copies", "c2:images/#.png c2:images_2/#.png c2:images_4/#.png", "images/0.png|",
       "images/1.png|", 2},
      {"a server's thumbs", "c2:a/#.jpg c:a/@eaDir/0.jpg/thumb.jpg", "a/0.jpg|", "a/1.jpg|", 2},
      {"results of earlier runs",
       "c2:a/#.jpg c2:dynfilter_out/overlays/#.png 82:people/#.png",
       "a/0.jpg|",
       "a/1.jpg|",
       2,
       "",
       {{"dynfilter_out/.dynfilter-run.txt", ""}, {"people/.dynfilter-masks.txt", ""}}},
      {"KITTI, raw", "c2:image_02/data/##########.png c2:image_03/data/##########.png",
       "image_02/data/0000000000.png|", "image_02/data/0000000001.png|", 2},
  };
}

TEST(FoundImages, AreThoseOfTheLayout) {
  for (const Layout& layout : layouts()) {
    SCOPED_TRACE(layout.name);
    const TemporaryFolder folder;
    for (const std::string& file : files_of(layout.files)) write_file(folder, file);
    for (const auto& [file, text] : layout.texts) folder.write(file, text);
    folder.write("camera.yaml", camera_yaml);
    const RgbdSequence sequence(folder.path());
    ASSERT_EQ(sequence.size(), layout.frames);
    EXPECT_EQ(names_of(sequence, 0), layout.first);
    EXPECT_EQ(names_of(sequence, layout.frames - 1), layout.last);
    EXPECT_NE(sequence.note().find(layout.note), std::string::npos) << sequence.note();
    EXPECT_EQ(sequence.has_depth(), layout.first.back() != '|');
    for (std::size_t i = 1; i < sequence.size(); ++i) {
      EXPECT_GT(sequence.entry(i).timestamp_s, sequence.entry(i - 1).timestamp_s);
    }
    const FrameView frame = sequence.read(0);
    EXPECT_EQ(frame.depth.empty(), !sequence.has_depth());
  }
}

TEST(FoundImages, CountTheFramesWithoutDepth) {
  const TemporaryFolder folder;
  for (const auto& file : files_of("c10:color/#.jpg d6:depth/#.png")) write_file(folder, file);
  folder.write("camera.yaml", camera_yaml);
  const RgbdSequence sequence(folder.path());
  EXPECT_EQ(sequence.note(), "10 colour images of color/, 6 depth images of depth/");
  EXPECT_EQ(sequence.size(), 6U);
  EXPECT_EQ(sequence.unpaired(), 4U);
  RgbdSequenceOptions options;
  options.keeps_unpaired = true;
  EXPECT_EQ(RgbdSequence(folder.path(), options).size(), 10U);
}

/// Depth of ScanNet has another size and almost the shape.
TEST(FoundImages, DepthOfAlmostTheShapeIsResized) {
  const TemporaryFolder folder;
  write_file(folder, "c:color/large 0.jpg");
  write_file(folder, "d:depth/0.png");
  folder.write("camera.yaml", camera_yaml);
  const FrameView frame = RgbdSequence(folder.path()).read(0);
  EXPECT_EQ(frame.depth.size(), cv::Size(1296, 968));
}

TEST(FoundImages, TakeTheCameraThatLiesThere) {
  const char* const open3d =
      "{\n  \"width\": 640,\n  \"height\": 480,\n  \"intrinsic_matrix\": [\n    600.5, 0, 0,\n    "
      "0, "
      "601.5, 0,\n    320.25, 240.75, 1\n  ]\n}\n";
  const char* const nerf =
      "{\"camera_model\": \"OPENCV\", \"frames\": [{\"fl_x\": 1, \"file_path\": \"a\\\"},{.png\"}],"
      "\"fl_x\": 600.5, \"fl_y\": 601.5, \"cx\": 320.25, \"cy\": 240.75, \"w\": 640, \"h\": 480, "
      "\"k1\": 1e-2}";
  const std::string closed = std::string("} ") + nerf;  // as a truncated file may begin
  for (const auto& [file, text] :
       {std::pair("camera_intrinsic.json", open3d), std::pair("intrinsic.json", open3d),
        std::pair("transforms.json", nerf), std::pair("transforms.json", closed.c_str())}) {
    const TemporaryFolder folder;
    write_file(folder, "c:color/0.jpg");
    write_file(folder, "d:depth/0.png");
    folder.write(file, text);
    const RgbdSequence sequence(folder.path());
    EXPECT_EQ(sequence.camera().fx, 600.5);
    EXPECT_EQ(sequence.camera().fy, 601.5);
    EXPECT_EQ(sequence.camera().cx, 320.25);
    EXPECT_EQ(sequence.camera().cy, 240.75);
    EXPECT_EQ(sequence.camera().k1, text == open3d ? 0 : 0.01);
    EXPECT_EQ(sequence.camera().image_size, cv::Size(640, 480));
    EXPECT_EQ(sequence.read(0).metres_per_unit, 0.001);
  }
  const TemporaryFolder folder;
  for (const char* text : {"", "{}", "[1, 2]", "{\"fl_x\": \"wide\"}", "{{{{", "\"",
                           "{\"frames\": [{\"fl_x\": 5, \"cx\": 1, \"cy\": 1}]}",
                           "{\"intrinsic_matrix\": [5, 0, 0, 0, 5, 0, 1, 1]}",
                           "{\"fl_x\": 1000000, \"cx\": 1, \"cy\": 1}",
                           "{\"camera_model\": \"OPENCV_FISHEYE\", \"fl_x\": 5}"}) {
    const fs::path file = folder.write("transforms.json", text);
    expect_failure([&] { read_camera(file); }, file.string());
  }
}

TEST(FoundImages, OrOneSentenceSaysWhatToDo) {
  const struct {
    std::string files;
    std::map<std::string, std::string> texts;
    const char* sentence;
    const char* sequence = "";
  } cases[] = {
      {"-:rgb.mp4 d:depth/0.png 8:confidence/0.png", {}, "rgb.mp4 is a film: mkdir color; ffmpeg"},
      {"-:IMG_0001.HEIC", {}, "IMG_0001.HEIC is a phone's image: mogrify -format jpg *.heic"},
      {"-:a.bag", {}, "is a file; want a folder of images. It is a recording of ROS", "a.bag"},
      {"-:a.svo2", {}, "a recording of a ZED camera", "a.svo2"},
      {"-:a.mcap", {}, "a recording of ROS", "a.mcap"},
      {"-:data.tar.gz", {}, "an archive: unpack it", "data.tar.gz"},
      {"8:masks/0.png", {}, "name the folder of the images itself"},
      {"d:depth/0.png c:rgb/0.png",
       {{"rgb.txt", "1341.5 rgb/0.png\n"}, {"depth.txt", "1344.0 depth/0.png\n"}},
       "by another clock? If so: --depth-offset 2.500"},
      {"d:depth/0.png c:rgb/0.png",
       {{"rgb.txt", "1341846434.5 rgb/0.png\n"}, {"depth.txt", "5.0 depth/0.png\n"}},
       "awk '!/^#/ {$1 = sprintf(\"%.6f\", $1 - (-1341846429.500))} 1' depth.txt >moved.txt"},
      {"d:depth/1341846434.500000.png c:rgb/1341846534.500000.png",
       {},
       "no image of the folder lie 0.02 s apart or less: images begin at 1341846534.500000"},
      {"c:rgb/0.png",
       {{"rgb.txt", "1.30503e+09 rgb/0.png\n"}},
       "rgb.txt:1: time: '1.30503e+09' has too few digits"},
      {"c:rgb/0.png", {{"rgb.txt", "1.5\n"}}, "got 1 columns; want 2: time, file"},
      {"c:rgb/0.png", {{"rgb.txt", "1.5 rgb\\1.png\n"}}, "rgb/1.png is missing"},
      {"c:image_2/0.png", {{"times.txt", "0\n.1\n.2\n"}}, "has 3 times for the 1 images in"},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(one.sentence);
    const TemporaryFolder folder;
    for (const std::string& file : files_of(one.files)) write_file(folder, file);
    for (const auto& [file, text] : one.texts) folder.write(file, text);
    folder.write("camera.yaml", camera_yaml);
    expect_failure([&] { RgbdSequence(folder / one.sequence); }, one.sentence);
  }
}

TEST(FoundImages, NameAPointerOfGitLfsInPlaceOfAnImage) {
  const TemporaryFolder folder;
  folder.write("0.jpg", "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 9\n");
  folder.write("1.jpg", "<!DOCTYPE html><html>");
  const RgbdSequence sequence(folder.path());
  expect_failure([&] { sequence.read(0); }, "0.jpg: is a pointer of Git LFS");
  expect_failure([&] { sequence.read(1); }, "1.jpg: is a web page");
}

TEST(FoundImages, NumbersInNamesCountByTheirValue) {
  std::istringstream text(
      "2 10 99999999999999999999999 100000000000000000000000 a a1 a1b2 a1b10 a9 a010 a10 b0");
  Files sorted = {""};
  for (std::string name; text >> name;) sorted.push_back(name);
  Files names(sorted.rbegin(), sorted.rend());
  std::sort(names.begin(), names.end(), detail::is_before);
  EXPECT_EQ(names, sorted);
}

}  // namespace
}  // namespace dynfilter::testing
