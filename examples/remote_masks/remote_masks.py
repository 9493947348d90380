#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Masks for dynfilter::RemoteSegmenter from a network in Python: put yours into Segmenter.

python3 remote_masks.py ADDRESS, which is a path, such as "$XDG_RUNTIME_DIR/masks.sock", or
tcp://127.0.0.1:PORT. Needs NumPy and PyZMQ (python3-numpy, python3-zmq).
"""

import errno
import json
import os
import socket
import stat
import sys
import traceback

import numpy as np
import zmq


class Segmenter:
    """Finds one object: all bright pixels. Replace it by your network, which is loaded here, once."""

    def __init__(self):
        self.level = 128

    def segment(self, image):
        """Finds objects in an array of bytes, H x W x 3 (blue, green, red) or H x W (grey).

        Returns a dict of lists or arrays with an entry for each object. Masks or boxes suffice:
          masks      N x H x W or N x 1 x H x W, as the image: above 0.5 if float, else not 0
          boxes      N x 4: x1, y1, x2, y2 in pixels; without them, the smallest around the masks
          scores     0 to 1; without them 1
          class_ids  without them 0, COCO's person, which dynfilter removes by default
          track_ids  whole numbers that stay with an object from frame to frame; may be left out
        """
        grey = image if image.ndim == 2 else image.mean(axis=2)
        mask = grey > self.level
        return {"masks": [mask] if mask.any() else []}


def encode(shape, masks=None, boxes=None, scores=None, class_ids=None, track_ids=None):
    """The instances of a reply, and the bytes of their masks."""
    if masks is None and boxes is None:
        raise ValueError("segment returned neither masks nor boxes; for nobody, {'boxes': []}")
    rows, crops = [{} for _ in (boxes if masks is None else masks)], []
    columns = {"mask": masks, "box": boxes, "score": scores, "class_id": class_ids, "track_id": track_ids}
    for name, column in columns.items():
        if column is not None and len(column) != len(rows):
            raise ValueError(f"a {name} for {len(column)} of {len(rows)} objects")
        for row, value in zip(rows, () if column is None else column):
            if name == "mask":
                crops.append(crop(np.asarray(value), shape, row))
            elif name == "box":
                low, high = np.asarray(value, float).reshape(2, 2)
                row["box"] = [*np.floor(low), *(np.ceil(high) - np.floor(low))]
            else:
                row[name] = float(value)
    return rows, b"".join(crops)


def crop(mask, shape, row):
    """The pixels of the part that holds the object; its x, y, width and height go into the row."""
    if mask.shape not in (shape, (1, *shape)):
        raise ValueError(f"a mask of shape {mask.shape}; want the image's, {shape}")
    on = (mask > 0.5 if mask.dtype.kind == "f" else mask != 0).reshape(shape)
    if on.any():
        ys, xs = np.nonzero(on)
        on = on[ys.min() : ys.max() + 1, xs.min() : xs.max() + 1]
        row["mask"] = [int(xs.min()), int(ys.min()), on.shape[1], on.shape[0]]
    return on.tobytes() if "mask" in row else b""


def answer(segmenter, parts):
    """The reply to a request: a header and masks. What goes wrong is said, and serving goes on."""
    request = None
    try:
        header = json.loads(parts[0])
        request, shape = header["request"], (header["height"], header["width"])
        image = np.frombuffer(bytearray(parts[1]), np.uint8)
        image = image.reshape(shape if header["channels"] == 1 else (*shape, 3))
        rows, masks = encode(shape, **segmenter.segment(image))
        if len(masks) > 64 << 20:
            raise ValueError(f"masks of {len(masks)} bytes; a host takes {64 << 20}")
        return [json.dumps({"request": request, "instances": rows}, allow_nan=False).encode(), masks]
    except (Exception, SystemExit) as problem:
        traceback.print_exc()
        text = f"{type(problem).__name__}: {problem}".encode(errors="replace").decode()
        return [json.dumps({"request": request, "error": text}).encode(), b""]


def bind(replies, path):
    """Makes a socket for this user alone, at a path where no other user can put another one."""
    folder = os.stat(os.path.dirname(path) or ".")
    others_write = folder.st_mode & 0o022 and not folder.st_mode & stat.S_ISVTX
    if others_write or folder.st_uid not in (0, os.geteuid()):
        raise PermissionError("other users may write to its folder, and replace the socket")
    with socket.socket(socket.AF_UNIX) as probe:
        is_free = probe.connect_ex(path) in (errno.ENOENT, errno.ECONNREFUSED)
    if not is_free or os.path.lexists(path) and not stat.S_ISSOCK(os.lstat(path).st_mode):
        raise FileExistsError("a process listens there, or it is no socket")
    before = os.umask(0o177)
    replies.bind("ipc://" + path)
    os.umask(before)


def serve(address, segmenter):
    """Answers one request at a time, of any number of hosts, until it is interrupted."""
    with zmq.Context() as context, context.socket(zmq.REP) as replies:
        replies.linger = 0
        replies.maxmsgsize = 3 << 25  # bytes of the largest image that a host sends
        replies.bind(address) if address.startswith("tcp:") else bind(replies, address.split("://")[-1])
        while True:
            replies.send_multipart(answer(segmenter, replies.recv_multipart()))


if __name__ == "__main__":
    try:
        serve(sys.argv[1] if len(sys.argv) == 2 else sys.exit(__doc__), Segmenter())
    except (KeyboardInterrupt, OSError, zmq.ZMQError) as end:
        sys.exit(f"{sys.argv[1]}: {end!r}")
