#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Reads what dynfilter wrote as others read it, without code of dynfilter, and prints it.

usage: neighbours.py csv FILE       a line a row, the cells divided by '|'
       neighbours.py pixels PNG...  a line a file: width, height, bits, and count and sum of non-zero values
       neighbours.py masks FOLDER   a line an instance: its cells, and the count and sums of x and y of its pixels
       neighbours.py tum FILE       the number of rows, as the benchmark's associate.py reads them
       neighbours.py colmap DATABASE IMAGES MASKS  the number of keypoints, and of those on masks
"""

import array
import csv
import pathlib
import sqlite3
import struct
import sys
import zlib


def read_png(path):
    """Returns width, height, bits and the values of a grey PNG, by the specification's words."""
    data = pathlib.Path(path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path}: no PNG"
    at, packed, header = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0] == zlib.crc32(kind + body), kind
        header = struct.unpack(">IIBBBBB", body) if kind == b"IHDR" else header
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    assert kind == b"IEND"
    width, height, bits, colour, _, _, interlaced = header
    assert colour == 0 and bits in (8, 16) and not interlaced, f"{path}: {header}"
    step, raw, above, values = bits // 8, zlib.decompress(packed), bytearray(width * bits // 8), []
    assert len(raw) == height * (1 + len(above))
    for y in range(height):
        rule, *line = raw[y * (1 + len(above)):(y + 1) * (1 + len(above))]
        for i in range(len(line)):
            a, b, c = (line[i - step], above[i], above[i - step]) if i >= step else (0, above[i], 0)
            nearest = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            line[i] = (line[i] + (0, a, b, (a + b) // 2, nearest)[rule]) % 256
        above = line
        values += line if step == 1 else [256 * high + low for high, low in zip(line[::2], line[1::2])]
    return width, height, bits, values


def read_csv(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.reader(file, strict=True))


def masks(folder):
    folder, maps = pathlib.Path(folder), {}
    for row in read_csv(folder / "instances.csv")[1:]:
        width, _, _, values = maps.setdefault(row[0], read_png(folder / f"{row[0]}.png"))
        pixels = [i for i, value in enumerate(values) if value == int(row[1])]
        print("|".join(row), len(pixels), sum(i % width for i in pixels), sum(i // width for i in pixels), sep="|")


def colmap(database, images, folder):
    keypoints = on_masks = 0
    query = "SELECT name, rows, cols, data FROM keypoints JOIN images USING (image_id)"
    for name, rows, columns, data in sqlite3.connect(database).execute(query):
        assert (pathlib.Path(images) / name).is_file()
        width, _, _, values = read_png(pathlib.Path(folder) / f"{name}.png")
        numbers = array.array("f", data)
        places = [int(numbers[k * columns + 1]) * width + int(numbers[k * columns]) for k in range(rows)]
        keypoints += rows
        on_masks += sum(values[place] == 0 for place in places)
    print(keypoints, on_masks)


def main():
    what, *paths = sys.argv[1:]
    if what == "csv":
        print("\n".join("|".join(row) for row in read_csv(paths[0])))
    elif what == "pixels":
        for width, height, bits, values in map(read_png, paths):
            print(width, height, bits, sum(map(bool, values)), sum(values))
    elif what == "masks":
        masks(paths[0])
    elif what == "colmap":
        colmap(*paths)
    else:
        lines = pathlib.Path(paths[0]).read_text().replace(",", " ").replace("\t", " ").split("\n")
        rows = [[v.strip() for v in line.split(" ") if v.strip()] for line in lines if line and line[0] != "#"]
        print(len({float(row[0]): [*map(float, row[1:8])] for row in rows if len(row) > 1}), {*map(len, rows)})


if __name__ == "__main__":
    main()
