#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Masks by a threshold, to try the channel without a network: all pixels brighter than LEVEL are
one person.

    python3 threshold.py SOCKET [LEVEL]

SOCKET is a path in a folder of yours, such as "$(mktemp -d)/masks.sock".
"""

import logging
import sys

import numpy as np

import remote_masks

PERSON = 0  # COCO


def threshold(level):
    def segment(image):
        grey = image if image.ndim == 2 else image.mean(axis=2)
        mask = grey > level
        if not mask.any():
            return []
        return [(PERSON, 1.0, None, mask)]

    return segment


# To use a network, replace threshold(). Load it once, before serving, and return whole-image masks
# of the image's size (many networks return smaller ones). remote_masks.instances() thresholds
# probabilities, and takes boxes as x1, y1, x2, y2.
#
# With ultralytics:
#
#   model = ultralytics.YOLO("yolo11n-seg.pt")
#
#   def segment(image):                            # BGR, as ultralytics expects an array
#       found = model(image, retina_masks=True, verbose=False)[0]     # masks of the image's size
#       if found.masks is None:
#           return []
#       boxes = found.boxes.cpu().numpy()
#       return remote_masks.instances(
#           found.masks.data.cpu().numpy(), boxes.xyxy, boxes.cls, boxes.conf)
#
# With torchvision's Mask R-CNN, which takes RGB, 0 to 1, and whose class 1 is the person:
#
#   def segment(image):
#       tensor = torch.from_numpy(image[:, :, ::-1].copy()).permute(2, 0, 1) / 255
#       with torch.inference_mode():
#           found = model([tensor.to(device)])[0]
#       found = {name: values.cpu().numpy() for name, values in found.items()}
#       people = (found["labels"] == 1) & (found["scores"] > 0.5)
#       return remote_masks.instances(
#           found["masks"][people], found["boxes"][people], None, found["scores"][people])


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    logging.basicConfig(format="%(name)s: %(message)s", level=logging.INFO)
    level = float(sys.argv[2]) if len(sys.argv) == 3 else 128.0
    # The first calls of a network are its slowest: make them before a host waits.
    threshold(level)(np.zeros((480, 640, 3), np.uint8))
    try:
        remote_masks.serve(sys.argv[1], threshold(level))
    except KeyboardInterrupt:
        pass
    except OSError as problem:
        sys.exit(f"threshold.py: {problem}")


if __name__ == "__main__":
    main()
