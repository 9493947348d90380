#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

"""Writes the models of the tests of dynfilter::networks: make_models.py FOLDER CUT_YOLO_HEADS.PY

They are tiny, and what they put out is known by hand: they find red and blue blocks of 32x32 pixels
in images of 64x64. Exit code 77 where python3-onnx is missing or too old. The folder is made anew.
"""

import math
import os
import shutil
import subprocess
import sys

try:
    import numpy as np
    import onnx
    from onnx import TensorProto, helper, numpy_helper
except ImportError as error:
    print(f"SKIPPED: python3-onnx is missing ({error})")
    sys.exit(77)

if tuple(int(part) for part in onnx.__version__.split(".")[:2]) < (1, 12):
    print(f"SKIPPED: onnx {onnx.__version__} is too old for examples/cut_yolo_heads.py, which wants 1.12")
    sys.exit(77)

SIDE = 64
CLASSES = ["red", "blue"]
PROTOTYPES = 4
MEAN_RED, DEVIATION_RED = 123.68, 58.40  # for YOLACT's input
MEAN_BLUE, DEVIATION_BLUE = 103.94, 57.38


class Graph:
    """Nodes and constants under construction."""

    def __init__(self):
        self.nodes = []
        self.constants = []
        self.inputs = [
            helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, SIDE, SIDE])
        ]
        self.outputs = []
        self.opset = 12
        self.domains = []

    def constant(self, values, dtype=np.float32, name=None):
        name = name or f"constant_{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(values, dtype), name))
        return name

    def node(self, operator, inputs, outputs=1, output=None, **attributes):
        names = [output] if output else [f"{operator}_{len(self.nodes)}_{i}" for i in range(outputs)]
        self.nodes.append(
            helper.make_node(operator, inputs, names, name=f"node_{len(self.nodes)}", **attributes)
        )
        return names[0] if outputs == 1 else names

    def reshape(self, tensor, shape, output=None):
        return self.node("Reshape", [tensor, self.constant(shape, np.int64)], output=output)

    def mean_over_cells(self, stride, weights, biases, source="images"):
        """Weighted mean of red, green and blue, plus a bias, for every cell of `stride` pixels."""
        weights = np.asarray(weights, np.float32)
        kernel = np.repeat(np.repeat(weights[:, :, None, None], stride, 2), stride, 3) / stride**2
        return self.node(
            "Conv",
            [source, self.constant(kernel), self.constant(biases)],
            kernel_shape=[stride, stride],
            strides=[stride, stride],
        )

    def output(self, tensor, name, shape):
        for node in self.nodes:
            node.output[:] = [name if output == tensor else output for output in node.output]
            node.input[:] = [name if source == tensor else source for source in node.input]
        self.outputs.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, shape))

    def save(self, folder, name, metadata=None, **options):
        graph = helper.make_graph(self.nodes, name, self.inputs, self.outputs, self.constants)
        opsets = [helper.make_opsetid("", self.opset)]
        opsets += [helper.make_opsetid(domain, 1) for domain in self.domains]
        model = helper.make_model(graph, opset_imports=opsets)
        model.ir_version = 7
        helper.set_model_props(model, metadata or {})
        onnx.save_model(model, os.path.join(folder, name + ".onnx"), **options)


# --- YOLO -----------------------------------------------------------------------------------------

YOLO_NAMES = {"names": "{0: 'red', 1: \"blue\"}", "task": "segment"}
STRIDES = [8, 16, 32]
ANCHORS = sum((SIDE // stride) ** 2 for stride in STRIDES)


def yolo_heads(graph):
    """A list per level of (boxes, classes, coefficients). Boxes are the cells themselves."""
    levels = []
    for stride in STRIDES:
        half_a_cell = [20.0, 20.0] + [-20.0] * 14  # distances 0 and 1 are equally likely
        boxes = graph.mean_over_cells(stride, np.zeros((64, 3)), half_a_cell * 4)
        sharpness = 40.0 if stride == 32 else 0.0  # only cells of 32 pixels detect anything
        classes = graph.mean_over_cells(
            stride, [[sharpness, 0, 0], [0, 0, sharpness]], [-20.0, -20.0]
        )
        coefficients = graph.mean_over_cells(
            stride, [[10, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 10]], np.full(PROTOTYPES, -2.5)
        )
        coefficients = graph.node("Relu", [coefficients])  # 0 for weak or grey colours
        levels.append((boxes, classes, coefficients))
    return levels


def prototypes(graph, red=(40.0, -20.0), blue=(40.0, -20.0), source="images"):
    """Above 0 on red (the first) or blue (the last); coefficients tell which."""
    weights = np.zeros((PROTOTYPES, 3))
    weights[0][0], weights[3][2] = red[0], blue[0]
    return graph.mean_over_cells(4, weights, [red[1], 0, 0, blue[1]], source)


def joined(graph, heads, channels):
    flat = [graph.reshape(head, [1, channels, -1]) for head in heads]
    return graph.node("Concat", flat, axis=2)


def yolo_raw(folder, name, has_open_size=False, metadata=None):
    graph = Graph()
    if has_open_size:
        graph.inputs = [
            helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, "height", "width"])
        ]
    levels = yolo_heads(graph)
    for index, (output, channels) in enumerate(
        [("output0", 64), ("output1", len(CLASSES)), ("output2", PROTOTYPES)]
    ):
        tensor = joined(graph, [level[index] for level in levels], channels)
        graph.output(tensor, output, [1, channels, ANCHORS])
    graph.output(prototypes(graph), "output3", [1, PROTOTYPES, 16, 16])
    graph.save(folder, name, {**YOLO_NAMES, **(metadata or {})})


def yolo_stock(folder, name, opset, has_masks=True):
    """A network that computes boxes itself, like exporters' models."""
    graph = Graph()
    graph.opset = opset
    levels = yolo_heads(graph)
    grid = prototypes(graph)
    coefficients = joined(graph, [level[2] for level in levels], PROTOTYPES)
    both = [graph.node("Concat", [level[0], level[1]], axis=1) for level in levels]
    both = joined(graph, both, 64 + len(CLASSES))
    if opset < 13:
        boxes, classes = graph.node("Split", [both], 2, axis=1, split=[64, len(CLASSES)])
    else:
        sizes = graph.constant([64, len(CLASSES)], np.int64)
        boxes, classes = graph.node("Split", [both, sizes], 2, axis=1)
    distances = graph.reshape(boxes, [1, 4, 16, ANCHORS])
    distances = graph.node("Transpose", [distances], perm=[0, 2, 1, 3])
    distances = graph.node("Softmax", [distances], axis=1)
    bins = graph.constant(np.arange(16).reshape(1, 16, 1, 1))
    distances = graph.node("Conv", [distances, bins], kernel_shape=[1, 1])
    distances = graph.reshape(distances, [1, 4, ANCHORS])

    def part(begin, end):
        limits = [graph.constant([value], np.int64) for value in (begin, end, 1)]
        return graph.node("Slice", [distances, *limits])

    centres, strides = [], []
    for stride in STRIDES:
        for cell in range((SIDE // stride) ** 2):
            row, column = divmod(cell, SIDE // stride)
            centres.append((column + 0.5, row + 0.5))
            strides.append(stride)
    centres = graph.constant(np.asarray(centres).T[None])
    first = graph.node("Sub", [centres, part(0, 2)])
    last = graph.node("Add", [centres, part(2, 4)])
    middle = graph.node("Div", [graph.node("Add", [first, last]), graph.constant(2.0)])
    sides = graph.node("Sub", [last, first])
    decoded = graph.node("Concat", [middle, sides], axis=1)
    decoded = graph.node("Mul", [decoded, graph.constant(np.asarray(strides)[None])])
    scores = graph.node("Sigmoid", [classes])
    decoded = graph.node("Concat", [decoded, scores], axis=1)
    if has_masks:
        everything = graph.node("Concat", [decoded, coefficients], axis=1)
        graph.output(everything, "output0", [1, 4 + len(CLASSES) + PROTOTYPES, ANCHORS])
        graph.output(grid, "output1", [1, PROTOTYPES, 16, 16])
    else:
        graph.output(decoded, "output0", [1, 4 + len(CLASSES), ANCHORS])
    graph.save(folder, name, YOLO_NAMES)


def yolo_end_to_end(folder):
    """Two objects, whatever the image; the score of a third is too low."""
    rows = np.zeros((3, 6 + PROTOTYPES))
    rows[0] = [0, 0, 32, 32, 0.5, 1, 1, 0, 0, 0]
    rows[1] = [32, 0, 64, 32, 0.75, 0, 1, 0, 0, 0]
    rows[2] = [0, 32, 32, 64, 0.125, 0, 0, 0, 0, 1]
    constant_rows(folder, "yolo_end_to_end", rows)


def constant_rows(folder, name, rows, has_masks=True):
    """Puts out these rows, whatever the image, after the prototypes of a network with masks."""
    graph = Graph()
    mean = graph.node("GlobalAveragePool", ["images"])
    values = graph.node(
        "Conv",
        [mean, graph.constant(np.zeros((rows.size, 3, 1, 1))), graph.constant(rows.flatten())],
        kernel_shape=[1, 1],
    )
    if has_masks:
        graph.output(prototypes(graph), "output1", [1, PROTOTYPES, 16, 16])
    graph.output(graph.reshape(values, [1, *rows.shape]), "output0", [1, *rows.shape])
    graph.save(folder, name, YOLO_NAMES)


def yolo_v5(folder):
    """Three anchors a cell; the score is the product of objectness and class."""
    rows = np.zeros((3 * ANCHORS, 5 + len(CLASSES) + PROTOTYPES))
    rows[7] = [48, 16, 32, 32, 0.5, 1, 0, 1, 0, 0, 0]
    rows[9] = [16, 48, 32, 32, 0.25, 0, 0.5, 0, 0, 0, 1]  # too weak together
    constant_rows(folder, "yolo_v5", rows)


def yolo_detectors(folder):
    """The objects of yolo_end_to_end, in the outputs of YOLOv8, v5, v6 and YOLO26 without masks."""
    rows = np.zeros((4 + len(CLASSES), ANCHORS))
    rows[:, 7] = [16, 16, 32, 32, 0, 0.5]
    rows[:, 9] = [48, 16, 32, 32, 0.75, 0]
    constant_rows(folder, "yolo_detector", rows, has_masks=False)
    rows = np.zeros((3 * ANCHORS, 5 + len(CLASSES)))
    rows[7] = [16, 16, 32, 32, 0.5, 0, 1]
    rows[9] = [48, 16, 32, 32, 0.75, 1, 0]
    constant_rows(folder, "yolo_detector_v5", rows, has_masks=False)
    rows = np.ones((ANCHORS, 5 + len(CLASSES)))
    rows[:, 5:] = 0
    rows[7, [0, 1, 2, 3, 6]] = [16, 16, 32, 32, 0.5]
    rows[9, [0, 1, 2, 3, 5]] = [48, 16, 32, 32, 0.75]
    constant_rows(folder, "yolo_detector_v6", rows, has_masks=False)
    constant_rows(folder, "bad_yolox", rows - 2.0, has_masks=False)
    rows = np.zeros((3, 6))
    rows[0] = [0, 0, 32, 32, 0.5, 1]
    rows[1] = [32, 0, 64, 32, 0.75, 0]
    constant_rows(folder, "yolo_detector_end_to_end", rows, has_masks=False)


def yolo_padded(folder):
    rows = np.full((3, 6 + PROTOTYPES), -1.0)
    rows[0] = [32, 0, 64, 32, 0.5, 0, 1, 0, 0, 0]
    constant_rows(folder, "yolo_padded", rows)


# --- Semantic networks ----------------------------------------------------------------------------


def semantic(folder, name, channels, plane, mean, deviation, stride=4, last=False, end=None,
             half=False, auxiliary=False, size=(SIDE, SIDE), metadata=None):  # fmt: skip
    """Puts out a high score of `plane` on red, after the operator `end`. With `last`, the channels
    are last in the input and the output."""
    graph = Graph()
    columns, rows = size
    source = "images"
    shape = [1, rows, columns, 3] if last else [1, 3, rows, columns]
    graph.inputs = [helper.make_tensor_value_info(source, TensorProto.FLOAT, shape)]
    if last:
        source = graph.node("Transpose", [source], perm=[0, 3, 1, 2])
    weights, biases = np.zeros((channels, 3)), np.zeros(channels)
    weights[plane][0], biases[plane] = normalized(40.0, -20.0, 255 * mean, 255 * deviation)
    scores = graph.mean_over_cells(stride, weights, biases, source)
    if end == "Softmax" or end == "ArgMax":
        scores = graph.node(end, [scores], axis=1)
    elif end:
        scores = graph.node(end, [scores])
    shape = [1, channels, rows // stride, columns // stride]
    if last:
        scores = graph.node("Transpose", [scores], perm=[0, 2, 3, 1])
        shape = [1, rows // stride, columns // stride, channels]
    graph.output(scores, "out", shape)
    if auxiliary:
        graph.output(graph.mean_over_cells(8, weights * 0, biases * 0), "aux", [1, channels, 8, 8])
    if half:
        for constant in graph.constants:
            values = numpy_helper.to_array(constant).astype(np.float16)
            constant.CopyFrom(numpy_helper.from_array(values, constant.name))
        for value in [*graph.inputs, *graph.outputs]:
            value.type.tensor_type.elem_type = TensorProto.FLOAT16
    graph.save(folder, name, metadata)


def semantics(folder):
    image_net = (0.485, 0.229)
    semantic(folder, "selfie", 1, 0, 0, 1, last=True, end="Sigmoid")
    semantic(folder, "selfie_logits", 1, 0, 0, 1)
    semantic(folder, "sinet", 2, 1, 0.4, 1, metadata={"mean": "[0.4 0.4 0.4]", "std": "1, 1.0, 1."})
    semantic(folder, "human_seg", 2, 1, 0.5, 0.5, end="Softmax")
    semantic(folder, "segnet", 12, 9, *image_net, stride=1)
    semantic(folder, "segformer", 19, 12, *image_net)
    semantic(folder, "segformer_150", 150, 12, *image_net)
    semantic(folder, "deeplab", 21, 15, *image_net, auxiliary=True)
    semantic(folder, "deeplab_half", 21, 15, *image_net, half=True)
    semantic(folder, "odd_size", 21, 15, *image_net, size=(75, 67))
    semantic(folder, "semantic_7", 7, 3, *image_net)
    semantic(folder, "bad_argmax", 21, 15, *image_net, end="ArgMax")
    semantic(folder, "bad_mean", 2, 1, 0.5, 0.5, metadata={"mean": "123.7, 116.3, 103.5"})


# --- YOLACT ---------------------------------------------------------------------------------------

MAPS = [(8, 8), (16, 4), (32, 2), (64, 1), (64, 1)]  # stride of the cells, cells a side
ANCHOR_SIDE = math.floor(96 / 550 * SIDE)  # side of the first prior of a cell of 32 pixels


def normalized(sharpness, offset, mean, deviation):
    """Weight and bias for sharpness * value / 255 + offset of a normalised input."""
    return sharpness * deviation / 255, sharpness * mean / 255 + offset


def shifted(graph, operator, domain=""):
    """The image as a deformable convolution reads it 32 pixels to the right of each pixel."""
    attributes = {"stride": 1, "padding": 1, "dilation": 1, "deformable_group": 1}
    if operator == "DeformConv":  # of ONNX
        graph.opset = 19
        attributes = {"strides": [1, 1], "pads": [1] * 4, "dilations": [1, 1], "offset_group": 1}
    if domain:
        graph.domains = [domain]
        attributes["domain"] = domain

    def same_everywhere(values):
        zeros = graph.constant(np.zeros((len(values), 3, 1, 1)))
        return graph.node("Conv", ["images", zeros, graph.constant(values)], kernel_shape=[1, 1])

    offsets = same_everywhere([0, 32] * 9)
    weights = graph.node("Sigmoid", [same_everywhere([0] * 9)])  # a half
    kernels = np.zeros((3, 3, 3, 3))
    kernels[range(3), range(3), 1, 1] = 2
    kernels, biases = graph.constant(kernels), graph.constant(np.zeros(3))
    inputs = ["images", offsets, weights, kernels, biases]
    if operator == "DeformConv":
        inputs = ["images", kernels, offsets, biases, weights]
    return graph.node(operator, inputs, **attributes)


def yolact(folder, name, priors_per_cell=3, softmax=True, channels_last=True, priors=None,
           deformable=None):  # fmt: skip
    graph = Graph()
    source = shifted(graph, *deformable) if deformable else "images"
    red = normalized(40.0, -20.0, MEAN_RED, DEVIATION_RED)
    blue = normalized(40.0, -20.0, MEAN_BLUE, DEVIATION_BLUE)
    rows = priors_per_cell * sum(side**2 for _, side in MAPS)
    heads = {"loc": [], "conf": [], "mask": []}
    for stride, side in MAPS:
        locations = np.zeros((priors_per_cell, 4))
        locations[0][2:] = math.log(32 / ANCHOR_SIDE) / 0.2  # a box of 32x32
        confidences = np.tile([20.0, 0, 0], (priors_per_cell, 1))  # background
        weights = np.zeros((priors_per_cell, 3, 3))
        if stride == 32:
            weights[0][1][0], weights[0][2][2] = red[0], blue[0]
            confidences[0] = [0, red[1], blue[1]]
        sure_red = normalized(10.0, 0, MEAN_RED, DEVIATION_RED)  # 0 or, after tanh, 1
        sure_blue = normalized(10.0, 0, MEAN_BLUE, DEVIATION_BLUE)
        coefficients = np.tile([sure_red[1], 0, 0, sure_blue[1]], (priors_per_cell, 1))
        mask_weights = np.zeros((priors_per_cell, PROTOTYPES, 3))
        mask_weights[:, 0, 0], mask_weights[:, 3, 2] = sure_red[0], sure_blue[0]
        for key, columns, weight, bias in [
            ("loc", 4, np.zeros((priors_per_cell * 4, 3)), locations),
            ("conf", 3, weights.reshape(-1, 3), confidences),
            ("mask", PROTOTYPES, mask_weights.reshape(-1, 3), coefficients),
        ]:
            head = graph.mean_over_cells(stride, weight, bias.flatten(), source)
            if key == "mask":
                head = graph.node("Tanh", [head])
            head = graph.node("Transpose", [head], perm=[0, 2, 3, 1])
            heads[key].append(graph.reshape(head, [1, side**2 * priors_per_cell, columns]))
    tensors = {key: graph.node("Concat", parts, axis=1) for key, parts in heads.items()}
    if softmax:
        tensors["conf"] = graph.node("Softmax", [tensors["conf"]], axis=2)
    grid = prototypes(graph, red, blue, source)
    shape = [1, PROTOTYPES, 16, 16]
    if channels_last:
        grid = graph.node("Transpose", [grid], perm=[0, 2, 3, 1])
        shape = [1, 16, 16, PROTOTYPES]
    if priors is not None:
        values = np.tile(priors, (rows, 1))
        graph.constant(values, name="priors")
        graph.outputs.append(
            helper.make_tensor_value_info("priors", TensorProto.FLOAT, values.shape)
        )
        graph.output(grid, "proto", shape)
    graph.output(tensors["mask"], "mask", [1, rows, PROTOTYPES])
    graph.output(tensors["loc"], "loc", [1, rows, 4])
    graph.output(tensors["conf"], "conf", [1, rows, 3])
    if priors is None:
        graph.output(grid, "proto", shape)
    graph.save(folder, name)


# --- Models that are refused ----------------------------------------------------------------------


def bad(folder):
    def small(name, change=lambda graph, cells: cells, shape=(1, 3, 8, 8), **options):
        """Saves a model of one layer, changed."""
        graph = Graph()
        cells = graph.mean_over_cells(8, np.ones((3, 3)), np.zeros(3))
        graph.output(change(graph, cells), "output0", list(shape))
        graph.save(folder, name, **options)

    def of_input(shape, *more):
        def change(graph, cells):
            graph.inputs = [helper.make_tensor_value_info("images", TensorProto.FLOAT, shape), *more]
            return graph.node("Add", [cells, more[0].name]) if more else cells

        return change

    def deformed(graph, cells):  # lacks offsets and weights
        graph.domains = ["yolact"]
        return graph.node("DCNv2", [cells], domain="yolact")

    second = helper.make_tensor_value_info("more", TensorProto.FLOAT, [1, 3, 8, 8])
    small("bad_operator", lambda graph, cells: graph.node("Frobnicate", [cells]))
    small("bad_outputs", lambda graph, cells: graph.reshape(cells, [1, 3, 4, 16]), (1, 3, 4, 16))
    small("bad_batch", of_input([2, 3, SIDE, SIDE]), (2, 3, 8, 8))
    small("bad_inputs", of_input([1, 3, SIDE, SIDE], second))
    small("bad_channels", of_input([1, 1, 8, 8]))
    small("bad_deformable", deformed)
    for name in ("external", "external_absent"):
        small(name, save_as_external_data=True, location=name + ".weights", size_threshold=0)
    os.remove(os.path.join(folder, "external_absent.weights"))


def main():
    folder = sys.argv[1]
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    yolo_raw(folder, "yolo_raw")
    yolo_raw(folder, "yolo_open_size", has_open_size=True)
    yolo_raw(folder, "yolo_dynamic", has_open_size=True, metadata={"imgsz": "[64, 64]"})
    yolo_raw(folder, "yolo_car_person", metadata={"names": "{0: 'car', 1: 'person'}"})
    for name, opset in [("yolo_stock", 12), ("yolo_stock_13", 13), ("yolo_stock_boxes", 12)]:
        yolo_stock(folder, name, opset, has_masks=name != "yolo_stock_boxes")
        paths = [os.path.join(folder, name + ending) for ending in (".onnx", "_cut.onnx")]
        subprocess.run([sys.executable, sys.argv[2], *paths], check=True)
    yolo_end_to_end(folder)
    yolo_v5(folder)
    yolo_detectors(folder)
    yolo_padded(folder)
    semantics(folder)
    yolact(folder, "yolact")
    yolact(folder, "yolact_logits", softmax=False, channels_last=False)
    half = ANCHOR_SIDE / SIDE / 2
    yolact(folder, "yolact_priors", priors=[[0.25, 0.75, half, half]])
    yolact(folder, "yolact_odd", priors_per_cell=4)
    yolact(folder, "yolact_plus", priors_per_cell=9, deformable=["DCNv2"])
    yolact(folder, "yolact_plus_onnx", deformable=["DeformConv"])
    mmcv = ["MMCVModulatedDeformConv2d", "mmdeploy"]
    yolact(folder, "yolact_plus_mmcv", priors_per_cell=9, deformable=mmcv)
    bad(folder)


if __name__ == "__main__":
    main()
