#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

"""Makes a YOLOv8 or YOLO11 model, -seg or a detector, run in OpenCV before 4.7, Debian 12's and Ubuntu 24.04's say.

    cut_yolo_heads.py yolov8n-seg.onnx yolov8n-seg-raw-heads.onnx

The exported model computes boxes by operations that such an OpenCV does not support. The script cuts
that part off the graph: the new model outputs its inputs, and dynfilter::NetworkSegmenter does the rest.
Weights and metadata stay unchanged. Needs python3-onnx (Debian 12, Ubuntu) or `pip install onnx`, 1.12 or newer. Export
with a fixed input size (not dynamic=True) and without nms=True.
"""

import argparse
import sys

try:
    import numpy as np
    import onnx
    from google.protobuf.message import DecodeError
    from onnx import TensorProto, helper, numpy_helper, shape_inference
except ImportError as error:
    sys.exit(
        f"cut_yolo_heads.py: python3-onnx is missing for {sys.executable} ({error}); install Debian's "
        f"package and use /usr/bin/python3, or run {sys.executable} -m pip install onnx"
    )

if tuple(int(part) for part in onnx.__version__.split(".")[:2]) < (1, 12):
    sys.exit(
        f"cut_yolo_heads.py: onnx {onnx.__version__} is too old, it does not know the shapes of all tensors; "
        "want 1.12 or newer"
    )


class NotYolo(Exception):
    """The graph is not a YOLOv8 or YOLO11 export."""


class Graph:
    """Nodes by the tensors that they compute, and the tensors' shapes."""

    def __init__(self, model):
        self.graph = model.graph
        self.producers = {name: node for node in model.graph.node for name in node.output}
        inferred = shape_inference.infer_shapes(model).graph
        self.shapes = {}
        for value in [*inferred.value_info, *inferred.input, *inferred.output]:
            sides = value.type.tensor_type.shape.dim
            self.shapes[value.name] = [side.dim_value for side in sides]

    def upwards(self, tensor):
        """The tensor and all tensors that it is computed from, the nearest first."""
        queue, seen = [tensor], {tensor}
        for name in queue:
            yield name
            producer = self.producers.get(name)
            for source in producer.input if producer else []:
                if source not in seen:
                    seen.add(source)
                    queue.append(source)

    def producer(self, tensor, operator):
        """The node of this kind that computes the tensor, or None."""
        node = self.producers.get(tensor)
        return node if node is not None and node.op_type == operator else None


def outputs_by_rank(graph):
    """The names of the decoded output [1, 4 + classes + P, N] and of the prototypes, None of a detector."""
    ranks = {3: [], 4: []}
    for output in graph.graph.output:
        ranks.setdefault(len(graph.shapes[output.name]), []).append(output.name)
    anchors = {graph.shapes[name][2] for name in ranks[3]}
    if len(ranks[3]) == 3 and len(ranks[4]) == 1 and len(anchors) == 1:
        raise NotYolo("its outputs are raw heads already; use it as it is")
    if len(graph.graph.output) == 1 and len(ranks[3]) == 1:
        return ranks[3][0], None
    if len(graph.graph.output) != 2 or len(ranks[3]) != 1 or len(ranks[4]) != 1:
        shapes = [graph.shapes[output.name] for output in graph.graph.output]
        raise NotYolo(f"its outputs have the shapes {shapes}; want [1, 4+C+P, N] and [1, P, h, w], or [1, 4+C, N]")
    return ranks[3][0], ranks[4][0]


def raw_heads(graph):
    """The tensors to output: boxes, classes and, but of a detector, coefficients and prototypes."""
    decoded, prototypes = outputs_by_rank(graph)
    _, rows, anchors = graph.shapes[decoded]
    count = graph.shapes[prototypes][1] if prototypes else 0

    def is_head(tensor, channels):
        return graph.shapes.get(tensor) == [1, channels, anchors]

    # The last node joins boxes and scores with the coefficients.
    last = graph.producer(decoded, "Concat")
    if last is None or (prototypes and not is_head(last.input[-1], count)):
        raise NotYolo("its output is no concatenation that ends with scores or the masks' coefficients")
    masks = [last.input[-1], prototypes] if prototypes else []

    # Scores are the logistic function of class logits.
    class_count = rows - 4 - count
    rest = [name for source in last.input[: -1 if masks else None] for name in graph.upwards(source)]
    sigmoids = [node for node in (graph.producer(name, "Sigmoid") for name in rest) if node]
    classes = next((n.input[0] for n in sigmoids if is_head(n.input[0], class_count)), None)
    if classes is None:
        raise NotYolo(f"it computes no scores [1, {class_count}, {anchors}] by Sigmoid")

    # Boxes come from distributions of the distances to four sides: the nearest tensor, not computed
    # from the scores, whose channels are a multiple of four and more than four.
    for name in rest:
        shape = graph.shapes.get(name, [])
        if len(shape) == 3 and shape[2] == anchors and shape[1] % 4 == 0 and shape[1] > 4:
            feeds = [node for node in graph.graph.node if name in node.input]
            if name != classes and any(node.op_type == "Reshape" for node in feeds):
                return [name, classes, *masks]
    raise NotYolo("it computes no distributions of distances [1, 4 bins, N]")


def rename(graph, old, new):
    for node in graph.node:
        node.input[:] = [new if name == old else name for name in node.input]
        node.output[:] = [new if name == old else name for name in node.output]


def drop_unused(graph):
    """Removes the nodes and constants that no output needs."""
    needed = {output.name for output in graph.output}
    nodes = []
    for node in reversed(graph.node):
        if needed.intersection(node.output):
            nodes.insert(0, node)
            needed.update(node.input)
    del graph.node[:]
    graph.node.extend(nodes)
    constants = [constant for constant in graph.initializer if constant.name in needed]
    del graph.initializer[:]
    graph.initializer.extend(constants)
    del graph.value_info[:]


def constant_values(graph, name):
    for constant in graph.initializer:
        if constant.name == name:
            return numpy_helper.to_array(constant)
    for node in graph.node:
        if node.op_type == "Constant" and name in node.output:
            return numpy_helper.to_array(node.attribute[0].t)
    return None


def slice_instead_of_split(graph):
    """Makes sizes of Split nodes attributes: OpenCV before 4.7 cannot read them as inputs (opset 13)."""
    nodes = []
    for node in graph.node:
        sizes = None
        if node.op_type == "Split" and len(node.input) == 2:
            sizes = constant_values(graph, node.input[1])
        if sizes is None:
            nodes.append(node)
            continue
        axis = next((a.i for a in node.attribute if a.name == "axis"), 0)
        ends = np.cumsum(sizes)
        for output, begin, end in zip(node.output, ends - sizes, ends):
            names = []
            for what, value in [("begin", begin), ("end", end), ("axis", axis)]:
                names.append(f"{output}_{what}")
                graph.initializer.append(
                    numpy_helper.from_array(np.array([value], np.int64), names[-1])
                )
            nodes.append(
                helper.make_node("Slice", [node.input[0], *names], [output], name=f"{output}_slice")
            )
    del graph.node[:]
    graph.node.extend(nodes)


def cut(model):
    graph = Graph(model)
    heads = raw_heads(graph)
    names = ["boxes", "classes", "coefficients", "prototypes"]
    del model.graph.output[:]
    for head, name in zip(heads, names):
        rename(model.graph, head, name)
        model.graph.output.append(
            helper.make_tensor_value_info(name, TensorProto.FLOAT, graph.shapes[head])
        )
    drop_unused(model.graph)
    slice_instead_of_split(model.graph)
    drop_unused(model.graph)  # the sizes of the splits
    onnx.checker.check_model(model)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("export", help="the model as exported")
    parser.add_argument("result", help="the model to write")
    arguments = parser.parse_args()
    try:
        model = onnx.load(arguments.export)
        if not model.graph.node:
            sys.exit(f"cut_yolo_heads.py: {arguments.export} is truncated or no ONNX model")
        cut(model)
        onnx.save(model, arguments.result)
    except NotYolo as error:
        sys.exit(
            f"cut_yolo_heads.py: {arguments.export} is no YOLOv8 or YOLO11 model as exported: "
            f"{error}"
        )
    except OSError as error:
        sys.exit(f"cut_yolo_heads.py: {error}")
    except DecodeError as error:
        sys.exit(
            f"cut_yolo_heads.py: {arguments.export} is truncated or no ONNX model ({error})"
        )
    except Exception as error:  # onnx.checker and shape_inference have types of their own
        sys.exit(f"cut_yolo_heads.py: {arguments.export}: {error}")


if __name__ == "__main__":
    main()
