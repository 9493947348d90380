# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Masks for dynfilter::RemoteSegmenter from a Python process. Needs NumPy, and Linux.

    import remote_masks
    remote_masks.serve("/run/user/1000/masks.sock", segment)

`segment(image)` gets its own uint8 array, H x W x 3 (blue, green, red, like OpenCV) or H x W (grey).
It returns a list with one (class_id, score, box, mask) for each object, or a dict with these keys
and, optionally, "track_id":

  class_id  int; 0 is COCO's person, the class that dynfilter treats as dynamic by default
  score     0 to 1
  box       the detector's (x, y, width, height) in pixels; None = the smallest around the mask
  mask      H x W, bool or integer, non-zero = on the object; None if only the box is known

The protocol is stated in README.md beside this file.
"""

import dataclasses
import fcntl
import logging
import math
import os
import select
import socket
import stat
import struct
import time

import numpy as np

log = logging.getLogger("remote_masks")

MAGIC = b"DYNF"
VERSION = 1
FRAME, INSTANCES, ERROR = 1, 2, 3

HEADER = struct.Struct("<4sHHIIQ")  # magic, version, type, payload bytes, reserved, request
FRAME_HEAD = struct.Struct("<QdIIBBHId")  # id, time, width, height, formats, reserved, depth scale
REPLY_HEAD = struct.Struct("<QIIII")  # frame id, width, height, instances, reserved
INSTANCE = struct.Struct("<if4i4iIi")  # class, score, box, mask's place, has track id, track id
CREDENTIALS = struct.Struct("3i")  # Linux: process, user, group

MAX_SIDE_PX = 16384
MAX_PIXELS = 1 << 25
MAX_INSTANCES = 1000
MAX_REPLY_BYTES = 64 << 20
MAX_ERROR_BYTES = 4096
MAX_BOX_COORDINATE_PX = 1 << 20
MAX_CONNECTIONS = 16
MESSAGE_TIMEOUT_S = 5.0  # for the rest of a message that has begun, and for sending a reply

IMAGE_CHANNELS = (1, 3)
DEPTH_TYPES = {1: np.dtype("<u2"), 2: np.dtype("<f4")}


class ProtocolError(Exception):
    """Received bytes that do not follow the protocol."""


@dataclasses.dataclass
class Frame:
    """The argument of `segment` if `serve` is called with pass_frame=True."""

    id: int
    timestamp_s: float
    image: np.ndarray
    depth: np.ndarray = None  # H x W, uint16 or float32; None if it is not sent
    metres_per_unit: float = 0.0  # of depth


def serve(path, segment, pass_frame=False):
    """Answers every frame received at `path` with the result of `segment`, until interrupted.

    Any number of hosts may connect, one after the other or together; this thread processes their
    frames one at a time. It logs an exception in `segment`, sends it to the host as the frame's
    error, and continues. See Server for the paths that it refuses.
    """
    with Server(path, segment, pass_frame) as server:
        server.serve_forever()


class Server:
    """Serves in steps: the constructor makes the socket, and close() removes it.

    Raises OSError if another process listens at the path, if the path is not a socket, or if other
    users could replace the socket in its folder. Replaces the socket of a dead process. Only
    processes of the same user may connect.
    """

    def __init__(self, path, segment, pass_frame=False):
        self._path = os.fspath(path)
        self._segment = segment
        self._pass_frame = pass_frame
        self._connections = []
        self._listener, self._identity = _listen(self._path)
        self._wake, self._woken = socket.socketpair()
        log.info("listening at %s", self._path)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def serve_forever(self):
        """Serves until stop() or an exception from outside `segment`, such as KeyboardInterrupt."""
        while True:
            sources = [self._woken, self._listener, *self._connections]
            ready = _wait_for(sources)
            if self._woken in ready:
                return
            if self._listener in ready:
                self._accept()
            for connection in ready:
                if connection in self._connections and not self._answer(connection):
                    self._connections.remove(connection)
                    connection.close()

    def stop(self):
        """Makes serve_forever() return after its current frame. May be called from any thread."""
        try:
            self._wake.send(b"x")
        except OSError:  # closed
            pass

    def close(self):
        for connection in self._connections:
            connection.close()
        self._connections = []
        if self._listener is not None:
            _remove_own(self._path, self._identity)
            self._listener.close()
            self._listener = None
        self._wake.close()
        self._woken.close()

    def _accept(self):
        try:
            connection, _ = self._listener.accept()
        except OSError as problem:  # the host has gone again, or too many files are open
            log.warning("no connection: %s", problem)
            time.sleep(0.1)
            return
        connection.settimeout(MESSAGE_TIMEOUT_S)
        problem = _problem_with_user(connection)
        if problem is None and len(self._connections) >= MAX_CONNECTIONS:
            problem = f"there are {MAX_CONNECTIONS} connections already"
        if problem is None:
            self._connections.append(connection)
            return
        log.warning("a connection is refused: %s", problem)
        try:
            connection.sendall(encode_error(0, problem))
        except OSError:
            pass
        connection.close()

    def _answer(self, connection):
        """Answers one frame. Returns whether the connection is still good."""
        try:
            message = receive_frame(connection)
            if message is None:
                return False
            request, frame = message
            connection.sendall(self._reply(request, frame))
            return True
        except ProtocolError as problem:
            log.warning("a connection is closed: %s", problem)
            try:
                connection.sendall(encode_error(0, str(problem)))
            except OSError:
                pass
        except OSError as problem:
            log.warning("a connection is lost: %s", problem)
        return False

    def _reply(self, request, frame):
        # Takes the size first, because segment may change its arrays.
        frame_id, shape = frame.id, frame.image.shape[:2]
        try:
            found = self._segment(frame if self._pass_frame else frame.image)
            return encode_instances(request, frame_id, shape, found)
        except Exception as problem:  # any exception of the network becomes the frame's error
            log.exception("frame %d", frame_id)
            return encode_error(request, f"{type(problem).__name__}: {problem}")


def _wait_for(sockets):
    """The connections with data to read. Unlike select(), accepts descriptors of any number."""
    poller = select.poll()
    for each in sockets:
        poller.register(each, select.POLLIN)
    ready = {descriptor for descriptor, _ in poller.poll()}
    return [each for each in sockets if each.fileno() in ready]


# --- Messages -------------------------------------------------------------------------------------


def receive_frame(connection):
    """(request, Frame), or None if the other side has closed the connection."""
    header = bytearray(HEADER.size)
    if not _receive_into(connection, header, may_end=True):
        return None
    magic, version, kind, payload_bytes, reserved, request = HEADER.unpack(header)
    if magic != MAGIC:
        raise ProtocolError("a message does not start with DYNF")
    if version != VERSION:
        raise ProtocolError(f"version {version} of the protocol; want {VERSION}")
    if kind != FRAME or reserved != 0 or request == 0:
        raise ProtocolError(f"a message of type {kind}, request {request}; want a frame")
    if payload_bytes < FRAME_HEAD.size:
        raise ProtocolError(f"a frame of {payload_bytes} bytes")
    head = bytearray(FRAME_HEAD.size)
    _receive_into(connection, head)
    frame, arrays = _frame_of(head)
    if payload_bytes != FRAME_HEAD.size + sum(shape[0] for shape, _ in arrays):
        raise ProtocolError(f"a frame of {payload_bytes} bytes, which is not what its images have")
    buffers = [bytearray(size) for (size, _), _ in arrays]
    for buffer in buffers:
        _receive_into(connection, buffer)
    pixels = [np.frombuffer(b, kind).reshape(shape) for b, ((_, shape), kind) in zip(buffers, arrays)]
    frame.image = pixels[0]
    frame.depth = pixels[1] if len(pixels) > 1 else None
    return request, frame


def _frame_of(head):
    """A frame without its pixels, and ((bytes, shape), type) of each image that follows."""
    frame_id, time_s, width, height, channels, depth, zero, zeros, scale = FRAME_HEAD.unpack(head)
    if not (1 <= width <= MAX_SIDE_PX and 1 <= height <= MAX_SIDE_PX and width * height <= MAX_PIXELS):
        raise ProtocolError(f"an image of {width}x{height}")
    if channels not in IMAGE_CHANNELS or (depth != 0 and depth not in DEPTH_TYPES):
        raise ProtocolError(f"an image of format {channels} with a depth of format {depth}")
    if zero != 0 or zeros != 0 or not math.isfinite(time_s):
        raise ProtocolError("a malformed frame")
    if (depth == 0 and scale != 0) or (depth != 0 and not 0 < scale < math.inf):
        raise ProtocolError(f"a depth of {scale} metres a unit")
    shape = (height, width) if channels == 1 else (height, width, channels)
    arrays = [((width * height * channels, shape), np.dtype(np.uint8))]
    if depth != 0:
        kind = DEPTH_TYPES[depth]
        arrays.append(((width * height * kind.itemsize, (height, width)), kind))
    return Frame(frame_id, time_s, None, None, scale), arrays


def _receive_into(connection, buffer, may_end=False):
    """Fills the buffer. Returns False if `may_end` and the connection was closed before any byte."""
    view = memoryview(buffer)
    end = time.monotonic() + MESSAGE_TIMEOUT_S
    while view:
        got = connection.recv_into(view)
        if got == 0:
            if may_end and len(view) == len(buffer):
                return False
            raise OSError("it was closed in the middle of a message")
        view = view[got:]
        if view and time.monotonic() > end:
            raise OSError("a message comes too slowly")
    return True


def encode_instances(request, frame_id, shape, found):
    """The reply to a frame. Raises ValueError or TypeError if `found` is no list of instances."""
    height, width = shape
    rows, crops = [], []
    for index, instance in enumerate(found):
        try:
            row, crop = _encode_instance(instance, height, width)
        except (ValueError, TypeError, KeyError, struct.error) as problem:
            raise ValueError(f"instance {index}: {problem}") from problem
        rows.append(row)
        crops.append(crop)
    if len(rows) > MAX_INSTANCES:
        raise ValueError(f"{len(rows)} instances; at most {MAX_INSTANCES} can be sent")
    head = REPLY_HEAD.pack(frame_id, width, height, len(rows), 0)
    payload = b"".join([head, *rows, *crops])
    if len(payload) > MAX_REPLY_BYTES:
        raise ValueError(f"masks of {len(payload)} bytes; at most {MAX_REPLY_BYTES} can be sent")
    return HEADER.pack(MAGIC, VERSION, INSTANCES, len(payload), 0, request) + payload


def encode_error(request, text):
    payload = text.encode("utf-8", "replace")[:MAX_ERROR_BYTES]
    return HEADER.pack(MAGIC, VERSION, ERROR, len(payload), 0, request) + payload


def _encode_instance(instance, height, width):
    track_id = None
    if isinstance(instance, dict):
        class_id, score = instance["class_id"], instance.get("score", 1.0)
        box, mask = instance.get("box"), instance.get("mask")
        track_id = instance.get("track_id")
        unknown = set(instance) - {"class_id", "score", "box", "mask", "track_id"}
        if unknown:
            raise ValueError(f"there is no {sorted(unknown)} in an instance")
    else:
        class_id, score, box, mask = instance
    score = float(score)
    if not 0 <= score <= 1:
        raise ValueError(f"score {score}; want 0 to 1")
    place, crop = _crop(mask, height, width)
    box = _box(box) if box is not None else place
    has_track_id = track_id is not None
    row = INSTANCE.pack(int(class_id), score, *box, *place, has_track_id, int(track_id or 0))
    return row, crop


def _box(box):
    """The smallest box of whole pixels that contains the box."""
    x, y, width, height = (float(value) for value in box)
    values = (x, y, width, height)
    if not all(abs(value) <= MAX_BOX_COORDINATE_PX // 2 for value in values) or min(width, height) < 0:
        raise ValueError(f"a box {values}; want (x, y, width, height) in pixels")
    left, top = math.floor(x), math.floor(y)
    return left, top, math.ceil(x + width) - left, math.ceil(y + height) - top


def _crop(mask, height, width):
    """The object's place (x, y, width, height), and its pixels, row by row, 0 or 1."""
    if mask is None:
        return (0, 0, 0, 0), b""
    mask = np.asarray(mask)
    if mask.shape != (height, width):
        raise ValueError(f"a mask of shape {mask.shape}; want the image's, {(height, width)}")
    if mask.dtype.kind not in "bui":
        raise ValueError(f"a mask of type {mask.dtype}; want bool or integer, such as mask > 0.5")
    on = mask != 0
    rows = np.flatnonzero(on.any(axis=1))
    if rows.size == 0:
        return (0, 0, 0, 0), b""
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    columns = np.flatnonzero(on[top:bottom].any(axis=0))
    left, right = int(columns[0]), int(columns[-1]) + 1
    crop = np.ascontiguousarray(on[top:bottom, left:right])
    return (left, top, right - left, bottom - top), crop.tobytes()


# --- The socket -----------------------------------------------------------------------------------


def _listen(path):
    """A socket that listens at `path` for this user alone, and the identity of its file."""
    folder = os.path.dirname(path) or "."
    # A process that replaces a socket holds its folder's lock. Otherwise one of two that start
    # together could take the other's new socket for a dead one.
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        _require_safe_folder(folder, os.fstat(lock))
        _lock(lock, folder)
        _remove_dead(path)
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            # The file gets the socket's mode (Linux), so that no other user can ever connect.
            os.fchmod(listener.fileno(), 0o600)
            listener.bind(path)
            os.chmod(path, 0o600)  # in case the umask removes our own rights
            listener.listen(MAX_CONNECTIONS)
            entry = os.lstat(path)
            return listener, (entry.st_dev, entry.st_ino)
        except BaseException:
            listener.close()
            raise
    finally:
        os.close(lock)


def _require_safe_folder(folder, entry):
    if entry.st_uid not in (os.geteuid(), 0):
        raise PermissionError(f"{folder}: belongs to another user")
    others_write = entry.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if others_write and not entry.st_mode & stat.S_ISVTX:
        raise PermissionError(f"{folder}: other users may write to it, and replace the socket")


def _lock(descriptor, folder):
    for _ in range(50):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            time.sleep(0.1)
    raise BlockingIOError(f"{folder}: is locked by another process")


def _remove_dead(path):
    """Removes the socket of a dead process, and nothing else."""
    try:
        entry = os.lstat(path)
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(entry.st_mode):
        raise FileExistsError(f"{path}: is there already, and no socket")
    if entry.st_uid != os.geteuid():
        raise PermissionError(f"{path}: belongs to another user")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        try:
            probe.connect(path)
        except ConnectionRefusedError:
            os.unlink(path)
            return
        except BlockingIOError:  # its queue of connections is full
            pass
    raise FileExistsError(f"{path}: another process listens there")


def _remove_own(path, identity):
    """Removes our socket, unless another process has replaced it."""
    try:
        entry = os.lstat(path)
        if (entry.st_dev, entry.st_ino) == identity:
            os.unlink(path)
    except OSError:
        pass


def _problem_with_user(connection):
    raw = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, CREDENTIALS.size)
    _, user, _ = CREDENTIALS.unpack(raw)
    return None if user == os.geteuid() else f"it is of user {user}, not {os.geteuid()}"
