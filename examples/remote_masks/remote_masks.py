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

`instances` makes this list of a network's arrays.

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
MAX_PATH_BYTES = 107
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


def instances(masks, boxes=None, class_ids=None, scores=None, threshold=0.5):
    """Makes the result of `segment` from a network's arrays, as torchvision and Ultralytics have them.

    masks: N x H x W or N x 1 x H x W of the image's size; bool or integer, non-zero = on the object,
        or float, on the object above the threshold; None if only boxes are known
    boxes: N x 4, x1, y1, x2, y2 in pixels; None = the smallest around the masks
    class_ids: N whole numbers; None = 0, COCO's person. torchvision's person is 1
    scores: N numbers from 0 to 1; None = 1

    dynfilter.Segmentation.from_masks takes the same. Raises ValueError for other shapes.
    """
    masks = _stacked(masks)
    boxes = None if boxes is None else np.asarray(boxes, float)
    if masks is None and boxes is None:
        raise ValueError("neither masks nor boxes; for nobody an array with N = 0")
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
        found.append((int(columns[0][k]), float(columns[1][k]), box, mask))
    return found


def _stacked(masks):
    """Masks as N x H x W; None stays."""
    if masks is None:
        return None
    masks = np.asarray(masks)
    if masks.ndim == 4 and masks.shape[1] == 1:
        return masks[:, 0]
    if masks.ndim != 3 and masks.size > 0:
        raise ValueError(f"masks of shape {masks.shape}; want N x H x W or N x 1 x H x W")
    return masks


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

    def __init__(self, path, segment, pass_frame=False):
        self._path = os.fspath(path)
        self._segment = segment
        self._pass_frame = pass_frame
        self._connections = []
        self._doubts = _Doubts()
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
            reply = encode_instances(request, frame_id, shape, found)
            for instance in found:
                self._doubts.look_at(instance)
            return reply
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


class _Doubts:
    """Warns once of each likely mistake that is no error. Looks at the first instances only."""

    MAX_LOOKED_AT = 50
    MIN_BOXES = 3
    MAX_LEVELS = 8  # of a mask's values

    def __init__(self):
        self._looked_at = self._boxes = self._corners = 0
        self._told = set()

    def look_at(self, instance):
        if self._looked_at >= self.MAX_LOOKED_AT:
            return
        self._looked_at += 1
        _, _, box, mask, _ = _fields(instance)
        if mask is None or not np.any(mask):
            return
        mask = np.asarray(mask)
        if mask.dtype.kind != "b" and np.unique(mask).size > self.MAX_LEVELS:
            self._tell("a mask has many grey levels, and every one but 0 counts as on the object; "
                       "send mask > threshold")
        if box is None:
            return
        place, _ = _crop(mask, *mask.shape)
        x, y, width, height = (float(value) for value in box)
        as_corners = _overlap((x, y, width - x, height - y), place)
        self._boxes += 1
        self._corners += as_corners > _overlap((x, y, width, height), place)
        if self._boxes >= self.MIN_BOXES and 2 * self._corners > self._boxes:
            self._tell("most boxes fit their masks better as x1, y1, x2, y2; want x, y, width, height, "
                       "which remote_masks.instances() makes of them")

    def _tell(self, text):
        if text not in self._told:
            self._told.add(text)
            log.warning("%s", text)


def _overlap(a, b):
    """Intersection over union of two boxes (x, y, width, height); 0 for one without area."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    return width * height / (a[2] * a[3] + b[2] * b[3] - width * height)


def encode_instances(request, frame_id, shape, found):
    """The reply to a frame. Raises ValueError or TypeError if `found` is no list of instances."""
    height, width = shape
    rows, crops = [], []
    if found is None or not hasattr(found, "__iter__"):
        what = "None" if found is None else f"one {type(found).__name__}"
        raise TypeError(f"segment returned {what}; want a list, [] for nobody")
    found = list(found)
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
    """class_id, score, box, mask and track_id of an instance, of which the last four may be None."""
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


def _encode_instance(instance, height, width):
    class_id, score, box, mask, track_id = _fields(instance)
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
    size = len(os.fsencode(path))
    if not 1 <= size <= MAX_PATH_BYTES:
        raise OSError(f"'{path}': a path of {size} bytes; a socket's has 1 to {MAX_PATH_BYTES}")
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
