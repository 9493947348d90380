// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "texture.hpp"

#include <algorithm>
#include <array>

#include "noise.hpp"

namespace dynfilter::scene {
namespace {

using Colour = cv::Vec3f;  // BGR

const Colour ink(45, 40, 38);
const Colour paper(222, 228, 230);
const Colour grey_tint(1.0F, 1.0F, 1.0F);

/// Picks a colour from a small palette that looks like printed matter.
Colour print_colour(std::uint64_t key) {
  static const std::array<Colour, 8> palette = {
      Colour(60, 70, 190),  Colour(170, 110, 40), Colour(70, 150, 90),  Colour(40, 170, 215),
      Colour(140, 70, 120), Colour(120, 150, 60), Colour(50, 110, 210), Colour(95, 95, 95)};
  return palette[mixed_bits(key) % palette.size()];
}

/// Paints a framed poster: writing, a picture of discs and bars, or a mosaic.
void poster(Canvas& canvas, cv::Rect area, std::uint64_t key) {
  canvas.rectangle(area, ink);
  const cv::Rect sheet(area.x + 4, area.y + 4, area.width - 8, area.height - 8);
  canvas.rectangle(sheet, paper);
  const int kind = static_cast<int>(mixed_bits(key) % 3);
  const cv::Rect body(sheet.x + 10, sheet.y + 12, sheet.width - 20, sheet.height - 24);
  if (kind == 0) {
    canvas.rectangle({body.x, body.y, body.width, 14}, print_colour(make_key(key, 1)));
    canvas.writing({body.x, body.y + 24, body.width, body.height - 24}, 16, {120, 116, 112}, key);
    return;
  }
  if (kind == 1) {
    canvas.mosaic(body, 14, print_colour(make_key(key, 2)), paper, key);
    return;
  }
  canvas.rectangle(body, print_colour(make_key(key, 3)), 0.6F);
  for (int i = 0; i < 18; ++i) {
    const std::uint64_t shape = make_key(key, 4, i);
    const int size = static_cast<int>(between(make_key(shape, 1), 6, 22));
    const int x =
        body.x + size + static_cast<int>(unit(make_key(shape, 2)) * (body.width - 2 * size));
    const int y =
        body.y + size + static_cast<int>(unit(make_key(shape, 3)) * (body.height - 2 * size));
    const Colour print = print_colour(make_key(shape, 4));
    const Colour colour = i % 3 == 0 ? paper : i % 3 == 1 ? ink : print;
    if (i % 2 == 0) {
      canvas.disc({x, y}, size, colour);
    } else {
      canvas.rectangle({x - size, y - size / 2, 2 * size, size}, colour);
    }
  }
}

/// Paints courses of bricks, no two quite alike.
void bricks(Canvas& canvas, cv::Rect area, std::uint64_t key) {
  constexpr int width = 64;
  constexpr int height = 24;
  canvas.rectangle(area, {150, 158, 160});
  for (int y = area.y, course = 0; y < area.br().y; y += height, ++course) {
    for (int x = area.x; x < area.br().x; x += width) {
      const std::uint64_t brick = make_key(key, course, x);
      const Colour clay(88, 104, 152);
      const auto shade = static_cast<float>(between(make_key(brick, 1), -66, 62));
      const int bottom = std::min(y + height - 4, area.br().y);
      canvas.rectangle({x + course % 2 * width / 2, y, width - 4, bottom - y},
                       clay + Colour(0.9F, 0.95F, 1.0F) * shade);
    }
  }
}

/// Paints the four walls side by side: plaster above bricks, posters in a loose row, stickers.
Canvas wall(std::uint64_t key) {
  Canvas canvas({2048, 1024}, {168, 182, 188});
  bricks(canvas, {0, 436, 2048, 588}, make_key(key, 1));
  canvas.noise(128, 18.0F, {1.05F, 1.0F, 0.92F}, key);
  canvas.rectangle({0, 422, 2048, 14}, {70, 84, 98});
  for (int i = 0; i < 11; ++i) {
    const std::uint64_t place = make_key(key, 100, i);
    const int width = static_cast<int>(between(make_key(place, 1), 110, 165));
    const int height = static_cast<int>(between(make_key(place, 2), 120, 210));
    const int x = i * 186 + static_cast<int>(between(make_key(place, 3), 0, 186 - width));
    const int y = static_cast<int>(between(make_key(place, 4), 120, 390 - height));
    poster(canvas, {x, y, width, height}, make_key(place, 5));
  }
  // Notes pinned to the plaster.
  for (int i = 0; i < 90; ++i) {
    const std::uint64_t place = make_key(key, 200, i);
    const int x = static_cast<int>(between(make_key(place, 1), 0, 2048));
    const int y = static_cast<int>(between(make_key(place, 2), 20, 400));
    const int size = static_cast<int>(between(make_key(place, 3), 6, 14));
    canvas.rectangle({x, y, 2 * size, size}, i % 3 == 0 ? paper : print_colour(place));
  }
  return canvas;
}

Canvas floor_tiles(std::uint64_t key) {
  Canvas canvas({1024, 1024}, {104, 120, 136});
  for (int y = 0; y < 1024; y += 64) {
    for (int x = 0; x < 1024; x += 64) {
      const auto shade = static_cast<float>(between(make_key(key, x, y), -44, 44));
      canvas.rectangle({x, y, 64, 64}, Colour(104, 120, 136) + grey_tint * shade);
      canvas.rectangle({x, y, 64, 3}, {70, 78, 84});
      canvas.rectangle({x, y, 3, 64}, {70, 78, 84});
    }
  }
  canvas.noise(64, 14.0F, grey_tint, key);
  return canvas;
}

Canvas wood(std::uint64_t key) {
  Canvas canvas({256, 256}, {66, 100, 142});
  for (int y = 0; y < 256; y += 32) {
    canvas.rectangle({0, y, 256, 2}, {40, 62, 92});
    canvas.rectangle({static_cast<int>(unit(make_key(key, y)) * 256), y, 3, 32}, {40, 62, 92});
  }
  canvas.noise(32, 13.0F, grey_tint, key);
  return canvas;
}

Canvas cardboard(std::uint64_t key) {
  Canvas canvas({256, 256}, {112, 150, 182});
  canvas.rectangle({0, 116, 256, 22}, {150, 186, 208});
  canvas.rectangle({30, 30, 70, 50}, paper);
  canvas.writing({36, 36, 58, 40}, 8, ink, key);
  canvas.mosaic({160, 160, 60, 60}, 12, ink, {120, 155, 185}, key);
  canvas.noise(32, 10.0F, grey_tint, key);
  return canvas;
}

Canvas books(std::uint64_t key) {
  Canvas canvas({512, 256}, {52, 58, 66});
  for (int shelf = 0; shelf < 2; ++shelf) {
    for (int x = 0, book = 0; x < 500; ++book) {
      const std::uint64_t one = make_key(key, shelf, book);
      const int width = static_cast<int>(between(make_key(one, 1), 10, 24));
      const int height = static_cast<int>(between(make_key(one, 2), 82, 112));
      const int top = 128 * shelf + 120 - height;
      const auto shade = static_cast<float>(between(make_key(one, 4), 0.5, 1.35));
      canvas.rectangle({x, top, width - 2, height}, print_colour(make_key(one, 3)) * shade);
      canvas.rectangle({x, top + 14, width - 2, 8}, paper, 0.8F);
      x += width;
    }
    canvas.rectangle({0, 128 * shelf + 120, 512, 8}, {60, 92, 128});
  }
  canvas.noise(16, 7.0F, grey_tint, key);
  return canvas;
}

Canvas screen(std::uint64_t key) {
  Canvas canvas({256, 256}, {58, 54, 50});
  canvas.rectangle({12, 12, 232, 232}, {124, 98, 66});
  canvas.writing({24, 28, 120, 190}, 10, {205, 210, 200}, key);
  canvas.mosaic({160, 40, 72, 72}, 12, {190, 180, 150}, {70, 60, 50}, key);
  canvas.noise(16, 6.0F, grey_tint, key);
  return canvas;
}

Canvas plain(cv::Size size, const Colour& colour, float amplitude, std::uint64_t key) {
  Canvas canvas(size, colour);
  canvas.noise(32, amplitude, grey_tint, key);
  return canvas;
}

/// Paints a plaid or striped shirt with a print on the chest, which is at u = 0.
Canvas shirt(int person, std::uint64_t key) {
  static const std::array<std::array<Colour, 3>, 4> designs = {{
      {Colour(52, 56, 176), Colour(34, 34, 92), Colour(196, 206, 218)},
      {Colour(150, 128, 46), Colour(86, 70, 28), Colour(214, 222, 226)},
      {Colour(60, 150, 206), Colour(30, 84, 130), Colour(70, 60, 60)},
      {Colour(120, 74, 132), Colour(66, 40, 74), Colour(216, 206, 214)},
  }};
  const auto& design = designs[static_cast<std::size_t>(person) % designs.size()];
  Canvas canvas({512, 512}, design[0]);
  for (int at = 0; at < 512; at += 32) {
    canvas.rectangle({0, at, 512, 14}, design[1], 0.65F);
    if (person % 2 == 0) canvas.rectangle({at, 0, 14, 512}, design[1], 0.65F);
    canvas.rectangle({0, at + 20, 512, 3}, design[2], 0.5F);
  }
  for (int i = 0; i < 40; ++i) {
    const std::uint64_t place = make_key(key, i);
    const cv::Point centre(static_cast<int>(unit(make_key(place, 1)) * 512),
                           static_cast<int>(unit(make_key(place, 2)) * 512));
    canvas.disc(centre, 4 + i % 4, i % 2 == 0 ? design[2] : ink, 0.55F);
  }
  canvas.rectangle({-44, 96, 88, 64}, design[2]);
  canvas.mosaic({-36, 104, 40, 48}, 8, ink, design[0], key);
  canvas.writing({12, 108, 26, 44}, 9, ink, key);
  canvas.noise(32, 9.0F, grey_tint, key);
  return canvas;
}

Canvas trousers(int person, std::uint64_t key) {
  static const std::array<Colour, 4> dyes = {Colour(128, 84, 54), Colour(72, 96, 112),
                                             Colour(70, 70, 74), Colour(96, 118, 92)};
  const Colour& dye = dyes[static_cast<std::size_t>(person) % dyes.size()];
  Canvas canvas({512, 512}, dye);
  for (int i = 0; i < 24; ++i) {
    const std::uint64_t place = make_key(key, i);
    const int x = static_cast<int>(unit(make_key(place, 1)) * 512);
    const int y = static_cast<int>(unit(make_key(place, 2)) * 512);
    const int side = static_cast<int>(between(make_key(place, 3), 12, 30));
    canvas.rectangle({x, y, side, side}, i % 2 == 0 ? dye * 0.55F : dye * 1.5F);
    canvas.rectangle({x + 3, y + 3, side - 6, side - 6}, dye * 0.9F);
  }
  for (int x = 0; x < 512; x += 128) canvas.rectangle({x, 0, 3, 512}, dye * 1.5F);
  canvas.noise(64, 13.0F, grey_tint, key);
  return canvas;
}

/// Paints skin with a face at u = 0; v = 0 is the middle of the head.
Canvas skin(int person, std::uint64_t key) {
  const Colour tone = person % 2 == 0 ? Colour(138, 168, 214) : Colour(92, 124, 172);
  Canvas canvas({512, 256}, tone);
  canvas.noise(32, 4.0F, grey_tint, key);
  for (const int side : {-1, 1}) {
    canvas.rectangle({side * 20 - 9, 12, 18, 4}, tone * 0.45F);
    canvas.disc({side * 20, 4}, 6, paper);
    canvas.disc({side * 20, 4}, 4, ink);
  }
  canvas.rectangle({-3, -16, 6, 18}, tone * 0.85F);
  canvas.rectangle({-14, -36, 28, 5}, {84, 84, 150});
  return canvas;
}

}  // namespace

Texture paint_material(Material material, double contrast, std::uint64_t seed) {
  const std::uint64_t key = make_key(seed, Stream::furniture, material);
  Canvas canvas = [&] {
    switch (material) {
      case Material::wall:
        return wall(make_key(seed, Stream::wall));
      case Material::floor:
        return floor_tiles(make_key(seed, Stream::floor));
      case Material::ceiling:
        return plain({256, 256}, {196, 204, 206}, 6.0F, key);
      case Material::wood:
        return wood(key);
      case Material::cardboard:
        return cardboard(key);
      case Material::books:
        return books(key);
      case Material::screen:
        return screen(key);
      default:
        return plain({256, 256}, {92, 76, 70}, 9.0F, key);
    }
  }();
  canvas.contrast(contrast);
  const bool is_large = material == Material::wall || material == Material::floor;
  return Texture(canvas.pixels(), is_large ? 0.004 : 0.003);
}

Texture paint_garment(Garment garment, int person, std::uint64_t seed) {
  const std::uint64_t key = make_key(seed, Stream::garment, garment, person);
  switch (garment) {
    case Garment::shirt:
      return Texture(shirt(person, key).pixels(), 0.002);
    case Garment::trousers:
      return Texture(trousers(person, key).pixels(), 0.002);
    case Garment::skin:
      return Texture(skin(person, key).pixels(), 0.0015);
    case Garment::hair:
      return Texture(
          plain({128, 128}, person % 2 == 0 ? Colour(34, 46, 62) : Colour(26, 26, 30), 9.0F, key)
              .pixels(),
          0.003);
    default:
      return Texture(plain({128, 128}, {52, 50, 58}, 12.0F, key).pixels(), 0.002);
  }
}

}  // namespace dynfilter::scene
