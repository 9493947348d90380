#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Tests of examples/remote_masks/remote_masks.py; remote_python_test.cpp runs them."""

import logging
import os
import pathlib
import random
import socket
import stat
import struct
import sys
import tempfile
import threading
import time
import unittest
import unittest.mock

import numpy as np

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "examples" / "remote_masks"
sys.dont_write_bytecode = True
sys.path.insert(0, str(EXAMPLE))
import remote_masks  # noqa: E402

logging.getLogger("remote_masks").setLevel(logging.CRITICAL + 1)

# The bytes of the tables in the example's README, as in remote_protocol_test.cpp.
FRAME_HEAD = bytes(
    [0x44, 0x59, 0x4E, 0x46, 1, 0, 1, 0, 70, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0]
    + [8, 7, 6, 5, 4, 3, 2, 1, 0, 0, 0, 0, 0, 0, 0xF8, 0x3F, 3, 0, 0, 0, 2, 0, 0, 0]
    + [3, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xD0, 0x3F]
)
PIXELS = bytes(range(18))
DEPTH = bytes(range(12))
FRAME = FRAME_HEAD + PIXELS + DEPTH

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
    head = struct.pack("<QdIIBBHId", 7, 1.5, width, height, 1, 0, 0, 0, 0.0)
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
        request, frame = self.receive(FRAME)
        self.assertEqual((request, frame.id, frame.timestamp_s), (9, 0x0102030405060708, 1.5))
        self.assertEqual((frame.image.shape, frame.image.dtype), ((2, 3, 3), np.uint8))
        self.assertEqual(frame.image.tobytes(), PIXELS)
        self.assertEqual((frame.depth.shape, frame.depth.dtype), ((2, 3), np.uint16))
        self.assertEqual(frame.depth[0].tolist(), [0x0100, 0x0302, 0x0504])
        self.assertEqual(frame.metres_per_unit, 0.25)
        frame.image[0, 0] = 1  # segment owns the image

    def test_a_frame_without_depth_has_none(self):
        _, frame = self.receive(frame_bytes())
        self.assertEqual(frame.image.shape, (6, 8))
        self.assertIsNone(frame.depth)

    def test_the_end_between_messages_is_no_error(self):
        self.assertIsNone(self.receive(b""))

    def test_every_truncation_is_an_error(self):
        for size in range(1, len(FRAME)):
            with self.assertRaises(OSError, msg=size):
                self.receive(FRAME[:size])

    def test_malformed_frames_are_refused(self):
        def changed(position, *values):
            data = bytearray(FRAME)
            data[position : position + len(values)] = bytes(values)
            return bytes(data)

        for data in [
            changed(0, 0),
            changed(4, 2),
            changed(6, 2),
            changed(8, 39),
            changed(8, 71),
            changed(11, 0xFF),
            changed(12, 1),
            changed(16, 0),
            changed(38, 0xF0, 0x7F),  # the time is infinite
            changed(40, 0),
            changed(40, 0, 0x40, 0, 0, 0, 0x40),  # 16384 x 16384
            changed(43, 0xFF),
            changed(48, 2),
            changed(48, 4),
            changed(49, 3),
            changed(49, 0),
            changed(50, 1),
            changed(52, 1),
            changed(63, 0xBF),  # a negative depth unit
            changed(62, 0xF8, 0x7F),
        ]:
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

    def test_boxes_hold_what_was_given(self):
        self.assertEqual(remote_masks._box((1.25, -2.5, 3.0, 1.0)), (1, -3, 4, 2))
        mask = np.zeros((6, 8), bool)
        mask[2:4, 5] = True
        row, _ = remote_masks._encode_instance((0, 1, None, mask), 6, 8)
        self.assertEqual(struct.unpack_from("<4i", row, 8), (5, 2, 1, 2))

    def test_what_is_no_instance_is_refused(self):
        mask = np.ones((6, 8), np.uint8)
        for found in [
            None,
            [None],
            [(0, 1.0, None)],
            [(0, float("nan"), None, mask)],
            [(0, 1.5, None, mask)],
            [(0, 1.0, (0, 0, -1, 1), mask)],
            [(0, 1.0, (0, 0, float("nan"), 1), mask)],
            [(0, 1.0, (0, 0, 1e9, 1), mask)],
            [(0, 1.0, (0, 0, 1), mask)],
            [(0, 1.0, None, mask[:5])],
            [(0, 1.0, None, mask.astype(np.float32))],
            [(0, 1.0, None, np.ones((6, 8, 1), bool))],
            [(1 << 40, 1.0, None, mask)],
            [{"score": 1.0, "mask": mask}],
            [{"class_id": 0, "masks": mask}],
            [(0, 1.0, (0, 0, 1, 1), None)] * 1001,
        ]:
            with self.assertRaises((ValueError, TypeError), msg=str(found)[:60]):
                remote_masks.encode_instances(1, 1, (6, 8), found)


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
        return stop

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

    def test_hosts_are_answered_one_after_the_other_and_together(self):
        self.start()
        connections = [self.connect() for _ in range(5)]
        for value, connection in enumerate(connections * 3):
            self.expect_answered(connection, value)
        connections[2].close()
        self.expect_answered(connections[1])

    def test_an_exception_is_the_frames_error_and_serving_goes_on(self):
        def segment(image):
            if image[0, 0] == 1:
                raise RuntimeError("out of memory")
            return [(3, float("nan") if image[0, 0] == 2 else 1.0, (0, 0, 1, 1), None)]

        self.start(segment)
        connection = self.connect()
        for value, text in [(1, b"RuntimeError: out of memory"), (2, b"instance 0: score nan")]:
            connection.sendall(frame_bytes(request=4, value=value))
            kind, request, payload = receive_message(connection)
            self.assertEqual((kind, request), (3, 4))
            self.assertIn(text, payload)
        self.expect_answered(connection)

    def test_a_long_error_is_cut(self):
        message = remote_masks.encode_error(1, "x" * 9999)
        self.assertEqual(len(message), 24 + 4096)
        self.assertEqual(struct.unpack_from("<HHI", message, 4), (1, 3, 4096))

    def test_another_version_is_told_so(self):
        self.start()
        connection = self.connect()
        connection.sendall(b"DYNF\x02\x00" + frame_bytes()[6:])
        kind, request, payload = receive_message(connection)
        self.assertEqual((kind, request), (3, 0))
        self.assertIn(b"version 2 of the protocol; want 1", payload)
        self.assertIsNone(receive_message(connection))

    def test_garbage_ends_its_connection_and_nothing_else(self):
        self.start()
        steady = self.connect()
        generator = random.Random(11)
        for _ in range(500):
            connection = self.connect()
            data = bytearray(frame_bytes())
            for _ in range(generator.randint(1, 4)):
                data[generator.randrange(64)] = generator.randrange(256)
            try:
                connection.sendall(data[: generator.randint(1, len(data))])
                connection.shutdown(socket.SHUT_WR)
                while connection.recv(4096):
                    pass
            except ConnectionError:
                pass
            connection.close()
        self.expect_answered(steady)

    def test_a_message_that_stops_is_given_up(self):
        timeout = remote_masks.MESSAGE_TIMEOUT_S
        self.addCleanup(setattr, remote_masks, "MESSAGE_TIMEOUT_S", timeout)
        remote_masks.MESSAGE_TIMEOUT_S = 0.05
        self.start()
        stalled = self.connect()
        stalled.sendall(frame_bytes()[:30])
        self.expect_answered(self.connect())
        self.assertIsNone(receive_message(stalled))

    def test_there_are_no_more_connections_than_allowed(self):
        self.start()
        connections = [self.connect() for _ in range(remote_masks.MAX_CONNECTIONS)]
        for connection in connections:
            self.expect_answered(connection)
        kind, request, payload = receive_message(self.connect())
        self.assertEqual((kind, request), (3, 0))
        self.assertIn(b"connections already", payload)
        self.expect_answered(connections[0])

    def test_it_can_be_stopped_in_the_middle(self):
        has_begun = threading.Event()
        may_end = threading.Event()

        def segment(image):
            has_begun.set()
            may_end.wait()
            return []

        stop = self.start(segment)
        connection = self.connect()
        connection.sendall(frame_bytes())
        has_begun.wait()
        threading.Timer(0.02, may_end.set).start()
        stop()
        self.assertFalse(os.path.exists(self.path))
        self.assertEqual(receive_message(connection)[0], 2)
        self.assertIsNone(receive_message(connection))

    # --- The socket's file ---

    def test_nobody_else_may_open_the_socket_whatever_the_umask(self):
        for mask in (0, 0o022, 0o077, 0o777):
            before = os.umask(mask)
            try:
                server = remote_masks.Server(self.path, None)
            finally:
                os.umask(before)
            self.assertEqual(stat.S_IMODE(os.lstat(self.path).st_mode), 0o600, oct(mask))
            server.close()
            self.assertFalse(os.path.exists(self.path))

    def test_nobody_else_may_open_the_socket_from_its_first_moment(self):
        with unittest.mock.patch.object(remote_masks.os, "chmod"):  # the server calls it later
            before = os.umask(0)
            try:
                server = remote_masks.Server(self.path, None)
            finally:
                os.umask(before)
        self.assertEqual(stat.S_IMODE(os.lstat(self.path).st_mode), 0o600)
        server.close()

    def test_the_socket_of_a_dead_process_is_replaced(self):
        dead = socket.socket(socket.AF_UNIX)
        dead.bind(self.path)
        dead.listen()
        dead.close()
        self.start()
        self.expect_answered(self.connect())

    def test_the_socket_of_a_living_process_stays(self):
        self.start()
        with self.assertRaisesRegex(FileExistsError, "another process listens there"):
            remote_masks.Server(self.path, None)
        self.expect_answered(self.connect())

    def test_a_living_process_whose_queue_is_full_is_seen(self):
        busy = socket.socket(socket.AF_UNIX)
        self.addCleanup(busy.close)
        busy.bind(self.path)
        busy.listen(0)
        self.connect()
        with self.assertRaisesRegex(FileExistsError, "another process listens there"):
            remote_masks.Server(self.path, None)
        self.assertTrue(os.path.exists(self.path))

    def test_a_path_that_is_too_long_is_named(self):
        for path in (self.path + "a" * 100, ""):
            with self.assertRaisesRegex(OSError, f"'{path}': a path of {len(path)} bytes"):
                remote_masks.Server(path, None)
        path = self.path + "a" * (107 - len(self.path))
        remote_masks.Server(path, None).close()

    def test_what_is_no_socket_stays(self):
        def write():
            with open(self.path, "w", encoding="ascii") as file:
                file.write("mine")

        target = os.path.join(self.folder.name, "target")
        for make in (write, lambda: os.mkdir(self.path), lambda: os.symlink(target, self.path)):
            make()
            before = os.lstat(self.path)
            with self.assertRaisesRegex(FileExistsError, "no socket"):
                remote_masks.Server(self.path, None)
            self.assertEqual(os.lstat(self.path), before)
            (os.rmdir if stat.S_ISDIR(before.st_mode) else os.unlink)(self.path)

    def test_a_socket_that_replaced_ours_stays(self):
        server = remote_masks.Server(self.path, None)
        os.rename(self.path, self.path + ".old")  # so that no inode is reused
        other = socket.socket(socket.AF_UNIX)
        self.addCleanup(other.close)
        other.bind(self.path)
        server.close()
        self.assertTrue(os.path.exists(self.path))

    def test_a_folder_that_others_may_write_to_is_refused(self):
        for mode in (0o777, 0o770, 0o702):
            os.chmod(self.folder.name, mode)
            with self.assertRaisesRegex(PermissionError, "other users may write"):
                remote_masks.Server(self.path, None)
        os.chmod(self.folder.name, 0o1777)
        remote_masks.Server(self.path, None).close()

    @unittest.skipIf(os.geteuid() != 0, "only root can give files away")
    def test_what_belongs_to_another_user_is_refused_and_stays(self):
        with socket.socket(socket.AF_UNIX) as dead:
            dead.bind(self.path)
        os.chown(self.path, 65534, -1)
        with self.assertRaisesRegex(PermissionError, "masks.sock: belongs to another user"):
            remote_masks.Server(self.path, None)
        self.assertTrue(os.path.exists(self.path))
        os.unlink(self.path)
        os.chown(self.folder.name, 65534, -1)
        with self.assertRaisesRegex(PermissionError, "belongs to another user"):
            remote_masks.Server(self.path, None)
        self.assertFalse(os.path.exists(self.path))

    def test_of_two_that_start_at_a_time_one_serves(self):
        remove_dead = remote_masks._remove_dead

        def remove_slowly(path):
            time.sleep(0.01)
            remove_dead(path)
            time.sleep(0.01)

        patch = unittest.mock.patch.object(remote_masks, "_remove_dead", remove_slowly)
        patch.start()
        self.addCleanup(patch.stop)
        for _ in range(3):
            dead = socket.socket(socket.AF_UNIX)
            dead.bind(self.path)
            dead.close()
            servers, refusals = [], []

            def start():
                try:
                    servers.append(remote_masks.Server(self.path, None))
                except FileExistsError as problem:
                    refusals.append(problem)

            threads = [threading.Thread(target=start) for _ in range(3)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual((len(servers), len(refusals)), (1, 2))
            self.connect()
            servers[0].close()

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


if __name__ == "__main__":
    unittest.main()
