// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The images of a sequence's folder: those that its lists name, or those that are found in it.

#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace dynfilter::detail {

/// An image as a list names it.
struct ListedImage {
  double time_s = 0;
  std::string file;  // as written; empty: no image
  std::filesystem::path path;
  std::filesystem::path list;  // or the folder, for an image that no list names
  std::size_t line = 0;        // 0: no list
  bool has_time = true;        // false: it is made up
};

struct ListedFrame {
  ListedImage image;
  ListedImage depth;  // without a file, if it is not listed beside the image
};

/// The lists of a folder, before images are paired.
struct ImageLists {
  bool are_pairs = false;  // frames have their depth, as those of associations.txt
  std::vector<ListedFrame> frames;
  std::vector<ListedFrame> depths;  // images of depth.txt, to be paired with those of the frames
  std::string note;                 // what was found without a list; empty: lists name all

  bool has_depth() const { return are_pairs || !depths.empty(); }
};

/// Images that were found in a folder, in the order of their names, in which 10 comes after 9.
struct FoundImages {
  std::vector<std::filesystem::path> colour, depth;
  std::vector<std::filesystem::path> deep;  // of 16 bits and one channel, without a word on depth
  std::size_t shallow_depth = 0;            // called depth, and of 8 bits
  std::filesystem::path other_depth;        // a file called depth for which there is advice
};

/// Looks for images in a folder and, if it holds none in colour, in those inside. Images are told
/// apart by the words in their names and in those of their folders, else by what they are. Leaves
/// out hidden files, what is called masks, labels, confidence or the like, and earlier results.
FoundImages find_images(const std::filesystem::path& folder);

/// Returns images by the times in their names, or else as 30 a second.
std::vector<ListedFrame> by_name(const std::vector<std::filesystem::path>& files,
                                 const std::filesystem::path& folder);

/// Reads the lists of TUM or OpenLORIS, EuRoC's csv or KITTI's times, or finds the images; depth
/// that no list names is found, too. Throws std::runtime_error that names file and line, or says
/// what a folder without images holds and what to do with it.
ImageLists read_image_lists(const std::filesystem::path& folder);

/// Says what to do with a file that is no folder of images, or with a folder of such files.
std::string advice_for(const std::filesystem::path& file);

}  // namespace dynfilter::detail
