// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "class_names.hpp"

#include <cstddef>
#include <sstream>
#include <string_view>

namespace dynfilter::detail {
namespace {

/// Reads a text from left to right.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : rest_(text) {}

  bool take(char wanted) {
    skip_blanks();
    if (rest_.empty() || rest_.front() != wanted) return false;
    rest_.remove_prefix(1);
    return true;
  }

  bool take_number(std::size_t wanted) {
    skip_blanks();
    const std::string digits = std::to_string(wanted);
    if (rest_.substr(0, digits.size()) != digits) return false;
    rest_.remove_prefix(digits.size());
    return true;
  }

  bool take_quoted(std::string& text) {
    skip_blanks();
    if (rest_.empty() || (rest_.front() != '\'' && rest_.front() != '"')) return false;
    const char quote = rest_.front();
    text.clear();
    for (std::size_t i = 1; i < rest_.size(); ++i) {
      if (rest_[i] == quote) {
        rest_.remove_prefix(i + 1);
        return true;
      }
      if (rest_[i] == '\\' && i + 1 < rest_.size()) ++i;
      text += rest_[i];
    }
    return false;
  }

  bool is_at_end() {
    skip_blanks();
    return rest_.empty();
  }

 private:
  void skip_blanks() {
    while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
  }

  std::string_view rest_;
};

}  // namespace

const std::vector<std::string>& coco_class_names() {
  static const std::vector<std::string> names = [] {
    std::istringstream all(
        "person,bicycle,car,motorcycle,airplane,bus,train,truck,boat,traffic light,"
        "fire hydrant,stop sign,parking meter,bench,bird,cat,dog,horse,sheep,cow,elephant,"
        "bear,zebra,giraffe,backpack,umbrella,handbag,tie,suitcase,frisbee,skis,snowboard,"
        "sports ball,kite,baseball bat,baseball glove,skateboard,surfboard,tennis racket,"
        "bottle,wine glass,cup,fork,knife,spoon,bowl,banana,apple,sandwich,orange,broccoli,"
        "carrot,hot dog,pizza,donut,cake,chair,couch,potted plant,bed,dining table,toilet,tv,"
        "laptop,mouse,remote,keyboard,cell phone,microwave,oven,toaster,sink,refrigerator,"
        "book,clock,vase,scissors,teddy bear,hair drier,toothbrush");
    std::vector<std::string> result;
    for (std::string name; std::getline(all, name, ',');) result.push_back(name);
    return result;
  }();
  return names;
}

std::vector<std::string> parse_class_names(const std::string& text) {
  Scanner scanner(text);
  std::vector<std::string> names;
  if (!scanner.take('{')) return {};
  std::string name;
  do {
    if (!scanner.take_number(names.size()) || !scanner.take(':') || !scanner.take_quoted(name)) {
      return {};
    }
    names.push_back(name);
  } while (scanner.take(','));
  if (!scanner.take('}') || !scanner.is_at_end()) return {};
  return names;
}

}  // namespace dynfilter::detail
