#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Tests of what segment may return to examples/remote_masks/remote_masks.py, of what the server
doubts, and of the page; remote_python_test.cpp runs them."""

import math
import os
import pathlib
import sys
import tempfile
import unittest
import unittest.mock

import numpy as np

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "examples" / "remote_masks"
sys.dont_write_bytecode = True
sys.path.insert(0, str(EXAMPLE))
import remote_masks  # noqa: E402


class Results(unittest.TestCase):
    def test_wrong_results_are_told_what_is_wanted(self):
        for found, text in [
            (None, r"segment returned None; want a list, \[\] for nobody"),
            (7, "segment returned one int; want a list"),
            ((0, 1.0, None, None), r"instance 0: is int; want \(class_id, score, box, mask\)"),
            ([(0, 1.0, None)], r"instance 0: is 3 values; want \(class_id, score, box, mask\) or a dict"),
            ([(0, 1.0, (0, 0, 1), None)], "a box of 3 numbers"),
            ([{"score": 1.0}], "instance 0: has no class_id"),
        ]:
            with self.assertRaisesRegex((ValueError, TypeError), text):
                remote_masks.encode_instances(1, 1, (6, 8), found)

    def test_instances_of_arrays(self):
        generator = np.random.default_rng(5)
        for _ in range(100):
            low = generator.uniform(-9, 9, (3, 2)).round(2)
            boxes = np.hstack([low, low + generator.uniform(0, 30, (3, 2)).round(2)])
            masks = generator.random((3, 6, 8), np.float32)
            found = remote_masks.instances(masks[:, None], boxes, [1, 2, 57], [0.5, 0.25, 1])
            self.assertEqual([f[:2] for f in found], [(1, 0.5), (2, 0.25), (57, 1.0)])
            for k, (_, _, box, mask) in enumerate(found):
                np.testing.assert_array_equal(mask, masks[k] > 0.5)
                x, y, width, height = remote_masks._box(box)
                self.assertEqual([x, y], np.floor(boxes[k, :2]).tolist())
                self.assertEqual([x + width, y + height], np.ceil(boxes[k, 2:]).tolist())
        ones = np.ones((2, 6, 8), np.uint8)
        self.assertEqual([f[:3] for f in remote_masks.instances(ones)], [(0, 1.0, None)] * 2)
        self.assertEqual(remote_masks.instances(None, [[1, 2, 3, 5]]), [(0, 1.0, (1, 2, 2, 3), None)])
        self.assertEqual(remote_masks.instances(np.zeros((0, 28, 28)), np.zeros((0, 4))), [])
        self.assertEqual(remote_masks.instances([], []), [])

    def test_other_arrays_are_refused(self):
        mask = np.ones((1, 6, 8), bool)
        for arguments, text in [
            ((None,), "neither masks nor boxes"),
            ((mask[0],), "want N x H x W"),
            ((mask, [[1, 2, 3]]), "x1, y1, x2, y2"),
            ((mask, [[4, 2, 3, 9]]), "x1 <= x2"),
            ((mask, [[0, 2, math.nan, 9]]), "x1 <= x2"),
            ((mask, None, [0, 1]), "class_ids of shape"),
            ((mask, None, None, 0.5), "scores of shape"),
        ]:
            with self.assertRaisesRegex(ValueError, text):
                remote_masks.instances(*arguments)


class Doubts(unittest.TestCase):
    def warnings(self, found):
        doubts = remote_masks._Doubts()
        with unittest.mock.patch.object(remote_masks.log, "warning") as warning:
            for instance in found:
                doubts.look_at(instance)
        return [call.args[1] for call in warning.call_args_list]

    @staticmethod
    def mask(x, y, width, height):
        mask = np.zeros((48, 64), np.uint8)
        mask[y : y + height, x : x + width] = 1
        return mask

    def test_boxes_of_the_other_form_are_told_once(self):
        places = [(10, 8, 20, 30), (30, 4, 12, 16), (5, 6, 20, 20), (20, 20, 10, 9)]
        good = [(0, 1.0, (x - 2, y - 1, w + 4, h + 9), self.mask(x, y, w, h)) for x, y, w, h in places]
        wrong = [(0, 1.0, (x, y, x + w, y + h), self.mask(x, y, w, h)) for x, y, w, h in places]
        self.assertEqual(self.warnings(good * 3), [])
        self.assertEqual(self.warnings(wrong[:2]), [])
        told = self.warnings(wrong * 3)
        self.assertEqual(len(told), 1)
        self.assertIn("x1, y1, x2, y2; want x, y, width, height", told[0])
        arrays = [np.stack([f[3] for f in wrong]), [f[2] for f in wrong]]
        self.assertEqual(self.warnings(remote_masks.instances(*arrays) * 3), [])
        self.assertEqual(self.warnings([(0, 1.0, None, f[3]) for f in wrong] * 3), [])

    def test_probabilities_are_told_once(self):
        grey = np.random.default_rng(7).random((48, 64))
        told = self.warnings([(0, 1.0, None, (grey * 255).astype(np.uint8))] * 3)
        self.assertEqual(len(told), 1)
        self.assertIn("many grey levels", told[0])
        self.assertEqual(self.warnings([(0, 1.0, None, grey > 0.5), (0, 1.0, None, None)]), [])
        self.assertEqual(self.warnings([(0, 1.0, None, (grey * 8).astype(np.uint8))]), [])

    def test_the_server_tells(self):
        with tempfile.TemporaryDirectory() as folder:
            box = (20, 20, 40, 40)
            segment = lambda image: [(0, 1.0, box, self.mask(20, 20, 20, 20))] * 3  # noqa: E731
            frame = remote_masks.Frame(1, 0.0, np.zeros((48, 64), np.uint8))
            with remote_masks.Server(os.path.join(folder, "s"), segment) as server:
                with unittest.mock.patch.object(remote_masks.log, "warning") as warning:
                    server._reply(1, frame)
                    server._reply(2, frame)
        self.assertEqual(warning.call_count, 1)


class Page(unittest.TestCase):
    def test_the_hosts_lines_are_those_of_the_test(self):
        page = (EXAMPLE / "README.md").read_text(encoding="utf-8")
        tested = pathlib.Path(__file__).with_name("remote_python_test.cpp").read_text(encoding="utf-8")
        blocks = page.split("```cpp\n")[1:]
        self.assertEqual(len(blocks), 1)
        lines = blocks[0].split("```")[0].splitlines(keepends=True)
        self.assertIn("".join("  " + line for line in lines), tested)


if __name__ == "__main__":
    unittest.main()
