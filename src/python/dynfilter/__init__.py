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
ValueError, files and networks that fail RuntimeError. The interpreter's lock is released while
filters, segmenters and readers of frames work, and one filter may serve many threads.
"""

import itertools
from typing import Any, Tuple

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
import numpy

from ._dynfilter import *  # noqa: F401,F403
from ._dynfilter import FeatureLabels, __version__


def keep_static(labels: FeatureLabels, *columns: Any) -> Tuple[Any, ...]:
    """Removes the removed features from parallel columns, in order.

        points, descriptors = dynfilter.keep_static(labels, points, descriptors)

    labels: FeatureLabels of N features
    columns: NumPy arrays with N rows, of any type and shape, lists or tuples with N elements

    Returns a tuple of new arrays and lists; yours stay as they are. Raises ValueError for a column
    of another length and for one that is given twice.
    """
    for i, column in enumerate(columns):
        wrong = _fault_of(column, columns[:i], len(labels))
        if wrong:
            raise ValueError(f"dynfilter::keep_static: got column {i}, {wrong}")
    return tuple(_kept(column, ~labels.removed) for column in columns)


def _fault_of(column: Any, others: Tuple[Any, ...], count: int) -> str:
    """Returns what is wrong with a column of keep_static, and what is wanted; mostly nothing."""
    if column is None and count == 0:
        return ""  # OpenCV's descriptors of no keypoints
    if not isinstance(column, (numpy.ndarray, list, tuple)):
        return f"a {type(column).__name__}; want a NumPy array, a list or a tuple"
    if isinstance(column, numpy.ndarray) and column.ndim == 0:
        return "an array without rows; want one row for each feature"
    if len(column) != count:
        return f"of {len(column)} elements; want one for each feature, {count}"
    for j, other in enumerate(others):
        if column is other and count > 0:  # OpenCV's empty results are one tuple
            return f"column {j} again; want others"
    return ""


def _kept(column: Any, is_kept: numpy.ndarray) -> Any:
    """Returns the kept elements of a column; None of None."""
    if isinstance(column, numpy.ndarray):
        return column.compress(is_kept, axis=0)
    return None if column is None else list(itertools.compress(column, is_kept))


__all__ = ["keep_static", *(name for name in vars(_dynfilter) if not name.startswith("_"))]
