// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "class_names.hpp"

#include <cstddef>
#include <iomanip>
#include <locale>
#include <sstream>

namespace dynfilter::detail {

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
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  std::vector<std::string> names;
  char mark = 0;
  if (!(in >> mark) || mark != '{') return {};
  do {
    std::size_t number = 0;
    if (!(in >> number >> mark >> std::ws) || number != names.size() || mark != ':') return {};
    const int quote = in.peek();
    std::string name;
    if (quote != '\'' && quote != '"') return {};
    if (!(in >> std::quoted(name, static_cast<char>(quote)) >> mark)) return {};
    names.push_back(name);
  } while (mark == ',');
  const bool is_whole = mark == '}' && (in >> std::ws).eof();
  return is_whole ? names : std::vector<std::string>();
}

}  // namespace dynfilter::detail
