# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Keeps the features of moving objects out of visual SLAM.

Takes a frame, its features and the masks of any instance segmentation, and tells which features are
safe to use:

    frame = dynfilter.FrameView(image=image, depth=depth, metres_per_unit=1 / 5000)
    people = dynfilter.Segmentation.from_masks(frame, masks, boxes)
    labels = dynfilter.DynamicFilter().apply(frame, people, points)
    points, descriptors = dynfilter.keep_static(labels, points, descriptors)

Images, depth, masks and points are NumPy arrays, or what numpy.asarray takes (tensors on the CPU).
They are not copied; an array of another type or layout is a ValueError that says what is wanted.
Names are those of the C++ library; accessors without arguments are properties. Wrong arguments are
ValueError, files and networks that fail RuntimeError. The interpreter's lock is released while the
library works, and one filter may serve many threads.
"""

try:
    from . import _dynfilter
except ImportError as error:
    import pathlib
    import sys
    import sysconfig

    own = "_dynfilter" + str(sysconfig.get_config_var("EXT_SUFFIX"))
    built = [path.name for path in pathlib.Path(__file__).parent.glob("_dynfilter.*")]
    if own in built:
        raise  # its own error says why
    raise ImportError(
        f"dynfilter: got {sys.executable}, which wants {own}; want the Python that dynfilter was "
        f"built for ({', '.join(built)}), see -DPython3_EXECUTABLE"
    ) from error
from ._dynfilter import *  # noqa: F401,F403
from ._dynfilter import __version__

__all__ = sorted(name for name in vars(_dynfilter) if not name.startswith("_"))
