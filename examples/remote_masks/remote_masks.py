# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Masks for dynfilter::RemoteSegmenter from a Python process. Needs NumPy, and Linux.

    import logging, remote_masks
    logging.basicConfig(level=logging.INFO)
    try:
        remote_masks.serve("/run/user/1000/masks.sock", segment)
    except KeyboardInterrupt:
        pass

`segment(image)` gets its own uint8 array, H x W x 3 (blue, green, red, like OpenCV) or H x W (grey).
It returns a list with one (class_id, score, box, mask) for each object, or a dict with these keys
and, optionally, "track_id":

  class_id  int; 0 is COCO's person, the class that dynfilter treats as dynamic by default
  score     0 to 1
  box       the detector's (x, y, width, height) in pixels; None = the smallest around the mask
  mask      H x W, bool or integer, non-zero = on the object; None if only the box is known

`instances` makes this list of a network's arrays. README.md beside this file states the protocol.
"""

import contextlib
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
FRAME_HEAD = struct.Struct("<QdIIB15s")  # id, time, width, height, channels, reserved
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


class ProtocolError(Exception):
    """Received bytes that do not follow the protocol."""


def serve(path, segment):
    """Answers every frame received at `path` with the result of `segment`, until interrupted.

    Any number of hosts may connect, one after the other or together; this thread processes their
    frames one at a time. It logs an exception in `segment`, sends it to the host as the frame's
    error, and continues. See Server for the paths that it refuses.
    """
    with Server(path, segment) as server:
        server.serve_forever()


def instances(masks, boxes=None, class_ids=None, scores=None, threshold=0.5):
    """Makes the result of `segment` from a network's arrays, as torchvision and Ultralytics have them.

    masks: N x H x W or N x 1 x H x W of the image's size; bool or integer, non-zero = on the object,
        or float, on the object above the threshold; None if only boxes are known
    boxes: N x 4, x1, y1, x2, y2 in pixels; None = the smallest around the masks
    class_ids: N whole numbers; None = 0, COCO's person. torchvision's person is 1
    scores: N numbers from 0 to 1; None = 1

    dynfilter.Segmentation.from_masks takes the same. Raises ValueError for other shapes.
    """
    if masks is None and boxes is None:
        raise ValueError("neither masks nor boxes; for nobody an array with N = 0")
    masks = None if masks is None else np.asarray(masks)
    if masks is not None and masks.ndim == 4 and masks.shape[1] == 1:
        masks = masks[:, 0]
    if masks is not None and masks.ndim != 3 and masks.size > 0:
        raise ValueError(f"masks of shape {masks.shape}; want N x H x W or N x 1 x H x W")
    boxes = None if boxes is None else np.asarray(boxes, float)
    count = len(boxes if masks is None else masks)
    if boxes is not None and count > 0 and boxes.shape != (count, 4):
        raise ValueError(f"boxes of shape {boxes.shape}; want {(count, 4)}: x1, y1, x2, y2 in pixels")
    columns = []
    for name, values, default in [("class_ids", class_ids, 0), ("scores", scores, 1.0)]:
        column = np.full(count, default) if values is None else np.asarray(values)
        if column.shape != (count,):
            raise ValueError(f"{name} of shape {column.shape}; want one for each instance, {(count,)}")
        columns.append(column)
    found = []
    for k in range(count):
        mask = None if masks is None else masks[k]
        if mask is not None and mask.dtype.kind == "f":
            mask = mask > threshold
        box = None if boxes is None else _box_between(*boxes[k].tolist())
        found.append((_class(columns[0][k]), float(columns[1][k]), box, mask))
    return found


def _box_between(x1, y1, x2, y2):
    """The smallest (x, y, width, height) of whole pixels that contains the corners."""
    if not all(map(math.isfinite, (x1, y1, x2, y2))) or x2 < x1 or y2 < y1:
        raise ValueError(f"a box {(x1, y1, x2, y2)}; want x1, y1, x2, y2 with x1 <= x2 and y1 <= y2")
    left, top = math.floor(x1), math.floor(y1)
    return left, top, math.ceil(x2) - left, math.ceil(y2) - top


class Server:
    """Serves in steps: the constructor makes the socket, and close() removes it.

    Raises OSError if another process listens at the path, if the path is not a socket, or if other
    users could replace the socket in its folder. Replaces the socket of a dead process. Only
    processes of the same user may connect.
    """

    def __init__(self, path, segment):
        self._path = os.fspath(path)
        self._segment = segment
        self._connections = []
        self._listener = _listen(self._path)
        self._wake, self._woken = socket.socketpair()
        log.info("listening at %s", self._path)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def serve_forever(self):
        """Serves until stop() or an exception from outside `segment`, such as KeyboardInterrupt."""
        while True:
            ready = _wait_for([self._woken, self._listener, *self._connections])
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
        self._wake.send(b"x")

    def close(self):
        with contextlib.suppress(OSError):
            os.unlink(self._path)
        for each in [*self._connections, self._listener, self._wake, self._woken]:
            each.close()

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
        else:
            _refuse(connection, problem)
            connection.close()

    def _answer(self, connection):
        """Answers one frame. Returns whether the connection is still good."""
        try:
            message = receive_frame(connection)
            if message is None:
                return False
            connection.sendall(self._reply(*message))
            return True
        except ProtocolError as problem:
            _refuse(connection, problem)
        except OSError as problem:
            log.warning("a connection is lost: %s", problem)
        return False

    def _reply(self, request, frame_id, image):
        shape = image.shape[:2]  # before segment, which may change its array
        try:
            return encode_instances(request, frame_id, shape, self._segment(image))
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


def _refuse(connection, problem):
    log.warning("a connection is refused: %s", problem)
    with contextlib.suppress(OSError):
        connection.sendall(encode_error(0, str(problem)))


# --- Messages -------------------------------------------------------------------------------------


def receive_frame(connection):
    """(request, frame id, image), or None if the other side has closed the connection."""
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
    frame_id, time_s, width, height, channels, zeros = FRAME_HEAD.unpack(head)
    if not (1 <= width <= MAX_SIDE_PX and 1 <= height <= MAX_SIDE_PX and width * height <= MAX_PIXELS):
        raise ProtocolError(f"an image of {width}x{height}")
    if channels not in (1, 3) or any(zeros) or not math.isfinite(time_s):
        raise ProtocolError("a malformed frame")
    if payload_bytes != FRAME_HEAD.size + width * height * channels:
        raise ProtocolError(f"a frame of {payload_bytes} bytes, which is not what its image has")
    pixels = bytearray(width * height * channels)
    _receive_into(connection, pixels)
    shape = (height, width) if channels == 1 else (height, width, channels)
    return request, frame_id, np.frombuffer(pixels, np.uint8).reshape(shape)


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
    if found is None or not hasattr(found, "__iter__"):
        what = "None" if found is None else f"one {type(found).__name__}"
        raise TypeError(f"segment returned {what}; want a list, [] for nobody")
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


def _fields(instance):
    """class_id, score, box, mask and track_id of an instance, of which the last three may be None."""
    if isinstance(instance, dict):
        unknown = set(instance) - {"class_id", "score", "box", "mask", "track_id"}
        if unknown:
            raise ValueError(f"there is no {sorted(unknown)} in an instance")
        if "class_id" not in instance:
            raise ValueError("has no class_id")
        rest = (instance.get(name) for name in ("box", "mask", "track_id"))
        return instance["class_id"], instance.get("score", 1.0), *rest
    fields = tuple(instance) if hasattr(instance, "__iter__") else ()
    if len(fields) != 4:
        got = f"{len(fields)} values" if fields else type(instance).__name__
        raise ValueError(f"is {got}; want (class_id, score, box, mask) or a dict")
    return *fields, None


def _class(class_id):
    if int(class_id) != class_id:
        raise ValueError(f"class id {class_id}; want a whole number")
    return int(class_id)


def _encode_instance(instance, height, width):
    class_id, score, box, mask, track_id = _fields(instance)
    score = float(score)
    if not 0 <= score <= 1:
        raise ValueError(f"score {score}; want 0 to 1")
    place, crop = _crop(mask, height, width)
    box = _box(box) if box is not None else place
    has_track_id = track_id is not None
    row = INSTANCE.pack(_class(class_id), score, *box, *place, has_track_id, int(track_id or 0))
    return row, crop


def _box(box):
    """The smallest box of whole pixels that contains the box."""
    values = tuple(float(value) for value in box)
    if len(values) != 4:
        raise ValueError(f"a box of {len(values)} numbers; want (x, y, width, height) in pixels")
    x, y, width, height = values
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
    rows, columns = np.flatnonzero(on.any(axis=1)), np.flatnonzero(on.any(axis=0))
    if rows.size == 0:
        return (0, 0, 0, 0), b""
    left, top, right, bottom = map(int, (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1))
    crop = np.ascontiguousarray(on[top:bottom, left:right])
    return (left, top, right - left, bottom - top), crop.tobytes()


# --- The socket -----------------------------------------------------------------------------------


def _listen(path):
    """A socket that listens at `path` for this user alone."""
    folder = os.path.dirname(path) or "."
    entry = os.stat(folder)
    if entry.st_uid not in (os.geteuid(), 0):
        raise PermissionError(f"{folder}: belongs to another user")
    others_write = entry.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if others_write and not entry.st_mode & stat.S_ISVTX:
        raise PermissionError(f"{folder}: other users may write to it, and replace the socket")
    _remove_dead(path)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        # The file gets the socket's mode (Linux), so that no other user can ever connect.
        os.fchmod(listener.fileno(), 0o600)
        listener.bind(path)
        os.chmod(path, 0o600)  # in case the umask removes our own rights
        listener.listen(MAX_CONNECTIONS)
        return listener
    except OSError as problem:
        listener.close()
        raise OSError(f"'{path}': {problem}") from problem


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


def _problem_with_user(connection):
    raw = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, CREDENTIALS.size)
    _, user, _ = CREDENTIALS.unpack(raw)
    return None if user == os.geteuid() else f"it is of user {user}, not {os.geteuid()}"
