#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Tests of examples/remote_masks/remote_masks.py and of its page; remote_python_test.cpp runs them."""

import logging
import math
import os
import pathlib
import socket
import stat
import struct
import sys
import tempfile
import threading
import unittest

import numpy as np

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "examples" / "remote_masks"
sys.dont_write_bytecode = True
sys.path.insert(0, str(EXAMPLE))
import remote_masks  # noqa: E402

logging.getLogger("remote_masks").setLevel(logging.CRITICAL + 1)

# The bytes of the tables in the example's README, as in remote_protocol_test.cpp.
FRAME_HEAD = bytes(
    [0x44, 0x59, 0x4E, 0x46, 1, 0, 1, 0, 58, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0]
    + [8, 7, 6, 5, 4, 3, 2, 1, 0, 0, 0, 0, 0, 0, 0xF8, 0x3F, 3, 0, 0, 0, 2, 0, 0, 0]
    + [3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
)
PIXELS = bytes(range(18))
FRAME = FRAME_HEAD + PIXELS

REPLY = bytes(
    [0x44, 0x59, 0x4E, 0x46, 1, 0, 2, 0, 126, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0]
    + [7, 0, 0, 0, 0, 0, 0, 0, 16, 0, 0, 0, 12, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0]
    + [0, 0, 0, 0, 0, 0, 0x40, 0x3F, 0xFF, 0xFF, 0xFF, 0xFF, 2, 0, 0, 0, 9, 0, 0, 0, 8, 0, 0, 0]
    + [2, 0, 0, 0, 3, 0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0xFC, 0xFF, 0xFF, 0xFF]
    + [56, 0, 0, 0, 0, 0, 0, 0x3F, 1, 0, 0, 0, 1, 0, 0, 0, 0x90, 1, 0, 0, 3, 0, 0, 0]
    + [0] * 24
    + [0, 1, 1, 1, 0, 1]
)


def frame_bytes(request=1, shape=(6, 8), value=3):
    """A grey frame as a host sends it."""
    height, width = shape
    head = struct.pack("<QdIIB15x", 7, 1.5, width, height, 1)
    payload = head + bytes([value]) * (width * height)
    return struct.pack("<4sHHIIQ", b"DYNF", 1, 1, len(payload), 0, request) + payload


def receive_message(connection):
    """(type, request, payload), or None at the end."""
    try:
        header = connection.recv(24, socket.MSG_WAITALL)
    except ConnectionResetError:  # the server closed before it read everything
        return None
    if len(header) < 24:
        return None
    _, _, kind, size, _, request = struct.unpack("<4sHHIIQ", header)
    return kind, request, connection.recv(size, socket.MSG_WAITALL) if size else b""


class Messages(unittest.TestCase):
    def receive(self, data):
        ours, theirs = socket.socketpair()
        with ours, theirs:
            theirs.sendall(data)
            theirs.close()
            return remote_masks.receive_frame(ours)

    def test_a_frame_is_read_from_its_golden_bytes(self):
        request, frame_id, image = self.receive(FRAME)
        self.assertEqual((request, frame_id), (9, 0x0102030405060708))
        self.assertEqual((image.shape, image.dtype, image.tobytes()), ((2, 3, 3), np.uint8, PIXELS))
        image[0, 0] = 1  # segment owns the image
        self.assertEqual(self.receive(frame_bytes())[2].shape, (6, 8))
        self.assertIsNone(self.receive(b""))

    def test_every_truncation_is_an_error(self):
        for size in range(1, len(FRAME)):
            with self.assertRaises(OSError, msg=size):
                self.receive(FRAME[:size])

    def test_malformed_frames_are_refused(self):
        infinite, too_large = (0xF0, 0x7F), (0, 0x40, 0, 0, 0, 0x40)
        for position, *values in [
            (0, 0), (4, 2), (6, 2), (8, 39), (8, 59), (11, 0xFF), (12, 1), (16, 0), (38, *infinite),
            (40, 0), (40, *too_large), (43, 0xFF), (48, 2), (48, 4), (49, 1), (52, 1), (63, 1),
        ]:
            data = bytearray(FRAME)
            data[position : position + len(values)] = bytes(values)
            with self.assertRaises(remote_masks.ProtocolError, msg=data.hex()):
                self.receive(data)

    def test_an_image_beyond_the_limit_is_refused_before_it_is_received(self):
        for width, height in [(16384, 2049), (16385, 1), (1, 16385)]:
            data = bytearray(frame_bytes())
            struct.pack_into("<I", data, 8, 40 + width * height)
            struct.pack_into("<II", data, 40, width, height)
            with self.assertRaisesRegex(remote_masks.ProtocolError, f"{width}x{height}"):
                self.receive(data)

    def test_a_reply_has_its_golden_bytes(self):
        mask = np.zeros((12, 16), np.uint8)
        mask[3:5, 2:5] = [[0, 1, 255], [7, 0, 1]]
        found = [
            {"class_id": 0, "score": 0.75, "box": (-1, 2, 9, 8), "mask": mask, "track_id": -4},
            (56, 0.5, (1, 1, 400, 3), None),
        ]
        self.assertEqual(remote_masks.encode_instances(5, 7, (12, 16), found), REPLY)

    def test_masks_are_cropped_to_what_is_on(self):
        generator = np.random.default_rng(3)
        for _ in range(200):
            height, width = generator.integers(1, 12, 2)
            mask = generator.random((height, width)) < generator.choice([0.02, 0.1, 0.5])
            (x, y, w, h), crop = remote_masks._crop(mask, height, width)
            pixels = np.frombuffer(crop, np.uint8).reshape(h, w)
            rebuilt = np.zeros_like(mask)
            rebuilt[y : y + h, x : x + w] = pixels
            np.testing.assert_array_equal(rebuilt, mask)
            if mask.any():
                for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]):
                    self.assertTrue(edge.any())


class Results(unittest.TestCase):
    def test_what_is_no_list_of_instances_is_refused(self):
        mask = np.ones((6, 8), np.uint8)
        for found, text in [
            (None, r"segment returned None; want a list, \[\] for nobody"),
            (7, "segment returned one int; want a list"),
            ((0, 1.0, None, None), r"instance 0: is int; want \(class_id, score, box, mask\)"),
            ([(0, 1.0, None)], r"instance 0: is 3 values; want"),
            ([(0, float("nan"), None, mask)], "score nan"),
            ([(0, 1.5, None, mask)], "score 1.5"),
            ([(0.9, 0, None, mask)], "class id 0.9; want a whole number"),
            ([(0, 1.0, (0, 0, 1), None)], "a box of 3 numbers"),
            ([(0, 1.0, (0, 0, -1, 1), mask)], "a box"),
            ([(0, 1.0, (0, 0, float("nan"), 1), mask)], "a box"),
            ([(0, 1.0, (0, 0, 1e9, 1), mask)], "a box"),
            ([(0, 1.0, None, mask[:5])], "a mask of shape"),
            ([(0, 1.0, None, mask.astype(np.float32))], "such as mask > 0.5"),
            ([(1 << 40, 1.0, None, mask)], "instance 0"),
            ([{"score": 1.0}], "instance 0: has no class_id"),
            ([{"class_id": 0, "masks": mask}], "there is no"),
            ([(0, 1.0, (0, 0, 1, 1), None)] * 1001, "1001 instances"),
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
            ((mask, None, [0.9]), "class id 0.9; want a whole number"),
            ((mask, None, None, 0.5), "scores of shape"),
        ]:
            with self.assertRaisesRegex(ValueError, text):
                remote_masks.instances(*arguments)


class Served(unittest.TestCase):
    """A server in a thread, in a folder of its own."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = os.path.join(self.folder.name, "masks.sock")

    def start(self, segment=lambda image: [(int(image.flat[0]), 1.0, (0, 0, 1, 1), None)]):
        server = remote_masks.Server(self.path, segment)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()

        def stop():
            server.stop()
            thread.join()
            server.close()

        self.addCleanup(stop)

    def connect(self):
        connection = socket.socket(socket.AF_UNIX)
        self.addCleanup(connection.close)
        connection.settimeout(60)  # so that the test cannot hang
        connection.connect(self.path)
        return connection

    def expect_answered(self, connection, value=3):
        connection.sendall(frame_bytes(request=21, value=value))
        kind, request, payload = receive_message(connection)
        self.assertEqual((kind, request), (2, 21))
        self.assertEqual(struct.unpack_from("<Qiii", payload), (7, 8, 6, 1))
        self.assertEqual(struct.unpack_from("<i", payload, 24), (value,))

    def test_an_exception_is_the_frames_error_and_serving_goes_on(self):
        def segment(image):
            if image[0, 0] == 1:
                raise RuntimeError("out of memory" + 9999 * "y")
            return [(3, float("nan") if image[0, 0] == 2 else 1.0, (0, 0, 1, 1), None)]

        self.start(segment)
        connection = self.connect()
        for value, text in [(1, b"RuntimeError: out of memory"), (2, b"instance 0: score nan")]:
            connection.sendall(frame_bytes(request=4, value=value))
            kind, request, payload = receive_message(connection)
            self.assertEqual((kind, request), (3, 4))
            self.assertIn(text, payload)
            self.assertLessEqual(len(payload), 4096)
        self.expect_answered(connection)

    def test_another_version_is_told_so(self):
        self.start()
        connection = self.connect()
        connection.sendall(b"DYNF\x02\x00" + frame_bytes()[6:])
        kind, request, payload = receive_message(connection)
        self.assertEqual((kind, request), (3, 0))
        self.assertIn(b"version 2 of the protocol; want 1", payload)
        self.assertIsNone(receive_message(connection))

    def test_a_message_that_stops_is_given_up(self):
        timeout = remote_masks.MESSAGE_TIMEOUT_S
        self.addCleanup(setattr, remote_masks, "MESSAGE_TIMEOUT_S", timeout)
        remote_masks.MESSAGE_TIMEOUT_S = 0.05
        self.start()
        stalled = self.connect()
        stalled.sendall(frame_bytes()[:30])
        self.expect_answered(self.connect())
        self.assertIsNone(receive_message(stalled))

    def test_hosts_are_answered_in_turn_and_no_more_than_allowed(self):
        self.start()
        connections = [self.connect() for _ in range(remote_masks.MAX_CONNECTIONS)]
        for value, connection in enumerate(connections):
            self.expect_answered(connection, value)
        kind, request, payload = receive_message(self.connect())
        self.assertEqual((kind, request), (3, 0))
        self.assertIn(b"connections already", payload)
        self.expect_answered(connections[0])

    # --- The socket's file ---

    def test_nobody_else_may_open_the_socket_whatever_the_umask(self):
        for mask in (0, 0o777):
            before = os.umask(mask)
            try:
                server = remote_masks.Server(self.path, None)
            finally:
                os.umask(before)
            self.assertEqual(stat.S_IMODE(os.lstat(self.path).st_mode), 0o600, oct(mask))
            server.close()
            self.assertFalse(os.path.exists(self.path))

    def test_the_socket_of_a_dead_process_is_replaced(self):
        with socket.socket(socket.AF_UNIX) as dead:
            dead.bind(self.path)
        self.start()
        self.expect_answered(self.connect())

    def test_what_is_no_dead_socket_stays(self):
        def write():
            with open(self.path, "w", encoding="ascii") as file:
                file.write("mine")

        for make in (write, lambda: os.mkdir(self.path), lambda: os.symlink("target", self.path)):
            make()
            before = os.lstat(self.path)
            with self.assertRaisesRegex(FileExistsError, "no socket"):
                remote_masks.Server(self.path, None)
            self.assertEqual(os.lstat(self.path), before)
            (os.rmdir if stat.S_ISDIR(before.st_mode) else os.unlink)(self.path)
        self.start()
        with self.assertRaisesRegex(FileExistsError, "another process listens there"):
            remote_masks.Server(self.path, None)
        self.expect_answered(self.connect())

    def test_a_path_that_is_too_long_is_named(self):
        for path in (self.path + "a" * 100, ""):
            with self.assertRaisesRegex(OSError, f"'{path}': "):
                remote_masks.Server(path, None)

    def test_a_folder_that_others_may_write_to_is_refused(self):
        os.chmod(self.folder.name, 0o770)
        with self.assertRaisesRegex(PermissionError, "other users may write"):
            remote_masks.Server(self.path, None)
        os.chmod(self.folder.name, 0o1777)
        remote_masks.Server(self.path, None).close()

    @unittest.skipIf(os.geteuid() != 0, "only root can be another user")
    def test_another_user_is_refused(self):
        self.start()
        os.chmod(self.folder.name, 0o755)
        os.chmod(self.path, 0o666)  # tests the check without the mode
        child = os.fork()
        if child == 0:
            code = 1
            try:
                os.setuid(65534)
                connection = socket.socket(socket.AF_UNIX)
                connection.connect(self.path)
                kind, request, payload = receive_message(connection)
                is_told = (kind, request) == (3, 0) and b"it is of user 65534, not 0" in payload
                code = 0 if is_told and receive_message(connection) is None else 2
            finally:
                os._exit(code)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        self.expect_answered(self.connect())


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
