// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What people bring, at each door of the program: it is right, or ends in the sentence that names
// cause and cure, the same at each door. The rooms of the readers and of the checks try more forms.

#include <opencv2/videoio.hpp>

#include "support/test.hpp"
#include "tools/changed_scene.hpp"
#include "tools/program.hpp"

namespace dynfilter::testing::doors {
namespace {

/// A rendered sequence of 16 frames, made once.
const fs::path& sixteen_frames() {
  static const TemporaryFolder folder;
  static const fs::path scene = folder.path() / "scene";
  if (!fs::exists(scene)) {
    succeed("synth " + quoted(scene) +
            " --level medium --seed 5 --frames 16 --width 320 --height 240");
  }
  return scene;
}

// --- Changes of the scene ------------------------------------------------------------------------

using Change = std::function<void(const fs::path& scene)>;
using TextChange = std::function<std::string(const std::string&)>;

Change images(const char* folder, const ImageChange& change) {
  return [=](const fs::path& s) { change_images(s / folder, change); };
}

/// Masks without a table: 255 on people.
Change masks(const ImageChange& of_binary_mask) {
  return [=](const fs::path& s) {
    fs::remove(s / "masks/instances.csv");
    change_images(s / "masks", [&](const cv::Mat& labels) { return of_binary_mask(labels > 0); });
  };
}

Change text(const char* file, const char* pattern, const char* by) {
  return [=](const fs::path& s) {
    change_text(s / file, [&](const std::string& all) {
      return std::regex_replace(all, std::regex(pattern), by);
    });
  };
}

Change camera(const std::string& key, const std::string& line) {
  return [=](const fs::path& s) { set_camera(s, key, line); };
}

Change camera_line(const std::string& line) {
  return
      [=](const fs::path& s) { std::ofstream(s / "camera.yaml", std::ios::app) << line << '\n'; };
}

Change file(const char* name, const std::string& content) {
  return [=](const fs::path& s) { std::ofstream(s / name) << content; };
}

Change removed(std::vector<const char*> names) {
  return [=](const fs::path& s) {
    for (const char* name : names) fs::remove_all(s / name);
  };
}

/// Gives the files of a folder the names of files `by` places before; the first have none then.
Change renamed_by(const char* folder, std::size_t by) {
  return [=](const fs::path& s) {
    const auto files = files_in(s / folder);
    for (std::size_t i = 0; i < by; ++i) fs::remove(files[i]);
    for (std::size_t i = by; i < files.size(); ++i) fs::rename(files[i], files[i - by]);
    for (std::size_t i = 0; i < by; ++i) fs::copy(files[0], files[files.size() - 1 - i]);
  };
}

Change operator+(const Change& a, const Change& b) {
  return [=](const fs::path& s) { a(s), b(s); };
}

ImageChange shifted(double x, double y) {
  return [=](const cv::Mat& image) {
    cv::Mat moved;
    const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, x, 0, 1, y);
    cv::warpAffine(image, moved, shift, image.size(), cv::INTER_NEAREST);
    return moved;
  };
}

ImageChange bits(int count) {
  return [count](const cv::Mat& image) {
    cv::Mat grey, deep;
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    grey.convertTo(deep, CV_16UC1, 1 << (count - 8));
    return deep;
  };
}

ImageChange resized(cv::Size size) {
  return [=](const cv::Mat& image) {
    cv::Mat other;
    cv::resize(image, other, size, 0, 0, cv::INTER_NEAREST);
    return other;
  };
}

// --- The doors -----------------------------------------------------------------------------------

enum Ends { works, doctor_breaks, refused };

/// What people bring. Doors are r(un), a(blate), d(octor), and masks' formats: s(tatic), c(olmap),
/// l(abels), h(oles in depth), and f, static and refined.
struct Fault {
  const char* name;
  Change make;
  const char* words;  // that must be said, divided by '|'; none: nothing is wrong
  Ends ends = works;
  const char* doors = "radsclhf";
  const char* options = "";
};

std::string command_of(char door, const fs::path& scene, std::string options, const fs::path& out) {
  static const std::map<char, std::string> commands = {{'r', "run --overlays 0 --rule mask "},
                                                       {'a', "ablate --rules none,mask "},
                                                       {'d', "doctor "},
                                                       {'s', "masks --format static "},
                                                       {'c', "masks --format colmap "},
                                                       {'l', "masks "},
                                                       {'h', "masks --format depth "},
                                                       {'f', "masks --format static --refine "}};
  const bool has_source = options.find("--mas") + 1 != 0 || options.find("--mod") + 1 != 0;
  if (door == 'l' && !has_source) options += " --masks " + quoted(scene / "masks");
  for (std::size_t at; (at = options.find("SCENE")) != std::string::npos;) {
    options.replace(at, 5, scene.string());
  }
  return commands.at(door) + quoted(scene) + " " + options +
         (door == 'd' ? "" : " --out " + quoted(out));
}

void expect_said(const Fault& fault, const Outcome& outcome) {
  std::istringstream words(fault.words);
  for (std::string word; std::getline(words, word, '|');) expect_mentions(outcome, word);
  if (*fault.words != '\0') return;
  const std::regex finding(
      "(^|\n)(\\* |odd +|broken +)?(masks|depth|image|camera|features|people|"
      "motion|unchecked)[a-z_]*: ");
  EXPECT_FALSE(std::regex_search(outcome.printed, finding)) << outcome.printed;
}

void expect_all(const std::vector<Fault>& faults) {
  const TemporaryFolder folder;
  const fs::path scene = folder / "scene", out = folder / "out";
  for (const Fault& fault : faults) {
    fs::remove_all(scene);
    fs::copy(sixteen_frames(), scene, fs::copy_options::recursive);
    fault.make(scene);
    for (const char door : std::string(fault.doors)) {
      fs::remove_all(out);
      const std::string command = command_of(door, scene, fault.options, out);
      SCOPED_TRACE(std::string(fault.name) + ": " + command);
      const Outcome outcome = run(command);
      const bool fails = fault.ends == refused || (fault.ends == doctor_breaks && door == 'd');
      EXPECT_EQ(outcome.exit_code, fails ? 1 : 0) << outcome.printed;
      expect_said(fault, outcome);
      EXPECT_EQ(fs::exists(out), !fails && door != 'd');
      EXPECT_FALSE(outcome.mentions("--features to")) << outcome.printed;
    }
  }
}

TEST(Doors, SayOfMasksWhatIsWrong) {
  const auto flipped = [](cv::Mat m) {
    cv::flip(m, m, 1);
    return m;
  };
  const auto soft = [](cv::Mat m) {
    cv::GaussianBlur(m, m, {9, 9}, 0);
    return m;
  };
  const auto rimmed = [](const cv::Mat& m) {
    cv::Mat wide;
    cv::dilate(m, wide, cv::Mat::ones(3, 3, CV_8UC1));
    return cv::Mat(wide - m / 17 * 16);  // 255 around 15
  };
  const Change some_missing = removed(
      {"masks/instances.csv", "masks/1.033333.png", "masks/1.066667.png", "masks/1.100000.png"});
  expect_all({
      {"nothing", [](const fs::path&) {}, ""},
      {"inverted", masks([](const cv::Mat& m) { return 255 - m; }),
       "masks_everywhere: masks cover |are they inverted"},
      {"full", masks([](const cv::Mat& m) { return cv::Mat(m | 255); }),
       "masks_everywhere: ", doctor_breaks},
      {"empty", masks([](const cv::Mat& m) { return m * 0; }) + removed({"masks_true"}),
       "masks_empty: |is nobody there?"},
      {"flipped", masks(flipped), "masks_elsewhere: |are they mirrored, or of other", works,
       "radf"},
      {"of later frames", renamed_by("masks", 8) + removed({"masks/instances.csv"}),
       "of other frames?", works, "radf"},
      {"soft", masks(soft), "masks_soft: |threshold them"},
      {"soft, beside a picture",
       masks(soft) + [](const fs::path& s) { fs::copy(s / "rgb/1.000000.png", s / "masks/a.png"); },
       "masks_soft: "},
      {"with a rim to ignore", masks(rimmed), "masks_values: "},
      {"of half the size", masks(resized({160, 120})), ""},
      {"of another shape", masks(resized({320, 320})), "320x320 pixels, but the frame has 320x240",
       refused},
      {"with classes from 1", text("masks/instances.csv", "\n([^,]*,[^,]*),0,", "\n$1,1,"),
       "masks_classes: |see --classes", works, "radscfh"},
      {"of some frames", some_missing, "3 of 16 frames have none|--missing-masks keep", refused,
       "rasclhf"},
      {"of some frames, examined", some_missing, "3 of 16 frames have no mask|--missing-masks keep",
       refused, "d"},
      {"of some frames, kept", some_missing, "3 of 16 frames have no mask", works, "radsclhf",
       "--missing-masks keep"},
      {"of another clock",
       removed({"masks/instances.csv"}) +
           [](const fs::path& s) {
             for (const auto& png : files_in(s / "masks")) {
               fs::rename(png, s / "masks" / ("9" + png.filename().string()));
             }
           },
       "16 of 16 frames have none: are they another", refused, "rasclhf"},
  });
}

TEST(Doors, SayItBeforeWhatRestsOnIt) {
  const TemporaryFolder folder;
  const fs::path scene = folder / "inverted", out = folder / "out";
  fs::copy(sixteen_frames(), scene, fs::copy_options::recursive);
  masks([](const cv::Mat& m) { return 255 - m; })(scene);
  expect_mentions(succeed(command_of('r', scene, "", out)),
                  "\nchecks of the input\n* masks_everywhere: ");
  fs::remove_all(out);
  const Outcome ablated = succeed(command_of('a', scene, "", out));
  expect_mentions(ablated, "checks of the input of inverted\n* masks_everywhere: ");
  EXPECT_LT(ablated.printed.find("checks of the input"), ablated.printed.find("all: "));
  const auto summary = read_json(out / "inverted" / "mask" / "summary.json");
  EXPECT_TRUE(summary.at("checks").contains("masks_everywhere"));
}

TEST(Doors, SayOfBoxesWhatIsWrong) {
  const auto boxes = [](const char* by) {
    return text("masks/instances.csv", "(\n[^,]*,[^,]*,0,[^,]*),(\\d+),(\\d+),(\\d+),(\\d+)", by);
  };
  const Change alone = images("masks", [](const cv::Mat& m) { return m * 0; });
  expect_all({
      {"y before x", boxes("$1,$3,$2,$5,$4"), "boxes: |y comes before x", works, "radsclhf"},
      {"beyond the image", boxes("$1,9$2,$3,$4,$5"),
       "boxes: |fit neither mask nor image: give both"},
      {"normalised", boxes("$1,0.31,0.2,0.1,0.4"), "x: got '0.31'; want a whole number", refused},
      {"alone", alone, "", works, "radf"},
      {"alone, without depth", alone, "people have boxes and no masks|--refine makes masks",
       refused, "sch"},
      {"alone, beyond the image", alone + boxes("$1,9000,$3,$4,$5"), "boxes: |image", works,
       "radf"},
  });
}

TEST(Doors, SayOfDepthAndImagesWhatIsWrong) {
  cv::Mat last;
  const auto of_before = [&](const cv::Mat& d) {
    const cv::Mat before = last.empty() ? d : last;
    last = d;
    return before;
  };
  const auto eight_bits = [](const cv::Mat& d) {
    cv::Mat shallow;
    d.convertTo(shallow, CV_8U, 1.0 / 256);
    return shallow;
  };
  const Change without_pairs = removed({"associations.txt"});
  expect_all({
      {"factor 1", camera("DepthMapFactor", "DepthMapFactor: 1"),
       "depth_unit: depth is too large|"
       "set DepthMapFactor in the camera file to",
       doctor_breaks, "radf"},
      {"factor of millimetres", camera("DepthMapFactor", "DepthMapFactor: 1000"),
       "depth_unit: depth is too large", works, "radf"},
      {"a frame late", images("depth", of_before), "depth_late: |--depth-offset", works, "radf"},
      {"not registered", images("depth", shifted(14, 2)), "depth_shift: ", works, "radf"},
      {"of 8 bits", images("depth", eight_bits), "want CV_16UC1", refused},
      {"of some frames", without_pairs + text("depth.txt", "\n1.[1-3][^\n]*", ""),
       "of 16 images have no depth at their time, and are left out", works, "radh"},
      {"of some frames, for masks", without_pairs + text("depth.txt", "\n1.[1-3][^\n]*", ""),
       "16 masks of the images", works, "sc"},
      {"of another clock", without_pairs + text("depth.txt", "\n1\\.", "\n7001."),
       "by another clock? If so, move its list: awk", refused, "radf"},
      {"of another clock, near", without_pairs + text("depth.txt", "\n1\\.", "\n4."),
       "by another clock? If so: --depth-offset 3.000", refused, "radf"},
      {"images of 10 bits in 16", images("rgb", bits(10)), "image_range: |scale the greys",
       doctor_breaks, "radscf"},
      {"images of 12 bits in 16", images("rgb", bits(12)), "image_range: ", works, "radscf"},
      {"a fisheye camera", camera_line("Camera.type: \"KannalaBrandt8\""),
       "Camera.type: ", refused},
      {"a rational camera", camera_line("Camera.k4: 0.3"), "Camera.k4: ", refused},
      {"a camera of another size", camera("Camera.cx", "Camera.cx: 318.6"), "camera_size: ", works,
       "radf"},
      {"no camera", removed({"camera.yaml"}), "there is no such camera file|DepthMapFactor",
       refused, "radf"},
      {"no camera, for masks", removed({"camera.yaml"}), "", works, "sclh"},
  });
}

const char* const pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d\nsize 9\n";

TEST(Doors, SayOfFilesWhatIsWrong) {
  const Change colour_lost = removed({"rgb", "rgb.txt", "depth.txt", "associations.txt"});
  expect_all({
      {"times in scientific notation", text("associations.txt", "\n[^ ]*", "\n1.30503e+09"),
       "associations.txt:2: time: '1.30503e+09' has too few digits|%.6f", refused},
      {"times in microseconds", text("associations.txt", "\n1\\.", "\n1305031100"),
       "want seconds, not microseconds", refused},
      {"a column too few", text("associations.txt", " depth/[^\n]*", ""),
       "got 3 columns; want 4: time and file", refused},
      {"another system's separators", text("associations.txt", "/", "\\\\"), ""},
      {"images that are missing", removed({"rgb/1.033333.png"}),
       "rgb/1.033333.png is missing (1 of the 32 image files", refused},
      {"a pointer for an image", file("rgb/1.000000.png", pointer), "is a pointer of Git LFS",
       refused},
      {"a pointer for a mask", file("masks/1.000000.png", pointer), "is a pointer of Git LFS",
       refused},
      {"other things beside the images",
       file("rgb/._1.000000.png", "x") + file(".DS_Store", "x") +
           [](const fs::path& s) {
             fs::copy(s / "masks", s / "confidence");
             fs::copy(s / "masks", s / "segmentation");
           },
       ""},
      {"a film for images", colour_lost + file("a.mp4", "film"), "a.mp4 is a film: mkdir color",
       refused},
      {"a bag for images", colour_lost + file("a.bag", "bag"), "save_frames", refused},
      {"a recording for images", colour_lost + file("a.mcap", "x"), "a recording of ROS", refused},
      {"a camera's file for images", colour_lost + file("a.svo2", "x"), "svo_export", refused},
  });
}

TEST(Doors, SayOfOtherToolsFilesWhatIsWrong) {
  const auto coco = [](const char* json) { return file("coco.json", json); };
  const Change labelme = [](const fs::path& s) {
    fs::create_directory(s / "lm");
    for (const char* name : {"lm/1.json", "lm/2.json"}) file(name, "{}")(s);
  };
  expect_all({
      {"a film for masks", file("m.mp4", "film"), "is a film", refused, "radscl",
       "--masks SCENE/m.mp4"},
      {"no masks", removed({"masks"}), "has no masks: name them by --masks", refused, "sch"},
      {"no masks, at others", removed({"masks"}), "no masks", works, "rad"},
      {"no such masks", file("x", ""), "there is no such folder", refused, "rasclhd",
       "--masks SCENE/m"},
      {"JPEG masks",
       [](const fs::path& s) {
         fs::remove(s / "masks/instances.csv");
         for (const auto& png : files_in(s / "masks")) fs::rename(png, png.string() + ".jpg");
       },
       "but 16 .jpg files", refused},
      {"labelme's files", labelme, "holds 2 .json files; want COCO's|labelme2coco", refused,
       "radscl", "--masks SCENE/lm"},
      {"a comma too many", coco("{\"images\": [{\"id\": 1},]}"),
       "coco.json: holds no masks in COCO's form|a comma too many", refused, "radscl",
       "--masks SCENE/coco.json"},
      {"masks of other images", coco("[{\"image_id\": 7, \"category_id\": 1}]"),
       "is of no frame of the sequence; frames are called as 1.000000", refused, "radscl",
       "--masks SCENE/coco.json"},
      {"weights for a model", file("n.pt", "PK\x03\x04"), "yolo export", refused, "rs",
       "--model SCENE/n.pt"},
      {"a pointer for a model", file("n.onnx", pointer), "is a pointer of Git LFS", refused, "rs",
       "--model SCENE/n.onnx"},
  });
}

/// Files in place of folders.
TEST(Doors, SayOfFilmsAndRecordingsWhatToDo) {
  const TemporaryFolder folder;
  const std::pair<const char*, const char*> files[] = {{"a.bag", "save_frames"},
                                                       {"a.mcap", "recording of ROS"},
                                                       {"a.db3", "recording of ROS"},
                                                       {"a.svo2", "svo_export"},
                                                       {"a.mp4", "reads no film from it"},
                                                       {"a1.jpg", "name its folder"},
                                                       {"a.txt", "is a list; want its folder"}};
  for (const auto& [name, cure] : files) {
    const fs::path file = folder.write(name, "no film");
    for (const char door : std::string("radsl")) {
      expect_refused(command_of(door, file, "--masks x", folder / "out"), cure);
    }
  }
  expect_refused("run 998", "there is no such folder, film or camera");
  const fs::path film = folder / "z.avi";
  cv::VideoWriter writer(film.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10,
                         {320, 240});
  writer.release();
  for (const char door : std::string("rd")) {
    expect_refused(command_of(door, film, "", folder / "out"),
                   "z.avi: OpenCV reads no frame of it");
  }
  writer.open(film.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10, {320, 240});
  for (int i = 0; i < 12; ++i) writer.write(cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(9 * i)));
  writer.release();
  fs::resize_file(film, fs::file_size(film) / 2);
  expect_mentions(succeed(command_of('r', film, "", folder / "out")),
                  "of 12 frames: is it cut off?");
}

}  // namespace
}  // namespace dynfilter::testing::doors
