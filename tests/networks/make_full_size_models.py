#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

"""Writes YOLACT and YOLACT++ with a ResNet-50 and random weights: make_full_size_models.py FOLDER

The layers have the shapes of the published networks (yolact_resnet50, yolact_plus_resnet50) for 550x550
pixels and 80 classes; YOLACT++ has its 13 deformable convolutions. Exit code 77 where python3-onnx is
missing. About 130 MB each.
"""

import os
import sys

try:
    import numpy as np
    import onnx
    from onnx import TensorProto, helper, numpy_helper
except ImportError as error:
    print(f"SKIPPED: python3-onnx is missing ({error})")
    sys.exit(77)

SIDE, CLASSES, PROTOTYPES = 550, 80, 32
MAPS = [69, 35, 18, 9, 5]


class Network:
    def __init__(self, deformable):
        self.deformable = deformable
        self.random = np.random.default_rng(1)
        self.nodes, self.constants = [], []

    def constant(self, values, dtype=np.float32):
        name = f"constant_{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(values, dtype), name))
        return name

    def node(self, operator, inputs, **attributes):
        name = f"{operator}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, inputs, [name], name=name, **attributes))
        return name

    def weights(self, outputs, inputs, side, gain):
        deviation = gain * np.sqrt(2 / (inputs * side * side))
        return self.random.normal(0, deviation, (outputs, inputs, side, side))

    def conv(self, tensor, inputs, outputs, side=1, stride=1, relu=True, gain=1.0, bias=0.0):
        pad = side // 2
        tensor = self.node(
            "Conv",
            [
                tensor,
                self.constant(self.weights(outputs, inputs, side, gain)),
                self.constant(np.zeros(outputs) + bias),
            ],
            kernel_shape=[side, side],
            strides=[stride, stride],
            pads=[pad] * 4,
        )
        return self.node("Relu", [tensor]) if relu else tensor

    def deformable_conv(self, tensor, channels, stride):
        """Like the export: one convolution of 27 channels gives offsets in y and x, and masks."""
        offsets = self.conv(tensor, channels, 18, 3, stride, relu=False, gain=0.5)
        mask = self.node("Sigmoid", [self.conv(tensor, channels, 9, 3, stride, relu=False, gain=0.5)])
        tensor = self.node(
            "DCNv2",
            [
                tensor,
                offsets,
                mask,
                self.constant(self.weights(channels, channels, 3, 2.0)),
                self.constant(np.zeros(channels)),
            ],
            domain="yolact",
            stride_h=str(stride), stride_w=str(stride),
            padding_h="1", padding_w="1",
            dilation_h="1", dilation_w="1",
            deformable_groups="1",
        )
        return self.node("Relu", [tensor])

    def bottleneck(self, tensor, inputs, planes, stride, is_deformable):
        inner = self.conv(tensor, inputs, planes)
        if is_deformable:
            inner = self.deformable_conv(inner, planes, stride)
        else:
            inner = self.conv(inner, planes, planes, 3, stride)
        inner = self.conv(inner, planes, 4 * planes, relu=False, gain=0.2)
        if inputs != 4 * planes or stride != 1:
            tensor = self.conv(tensor, inputs, 4 * planes, 1, stride, relu=False, gain=0.7)
        return self.node("Relu", [self.node("Add", [inner, tensor])])

    def backbone(self):
        tensor = self.conv("input", 3, 64, 7, 2)
        tensor = self.node(
            "MaxPool", [tensor], kernel_shape=[3, 3], strides=[2, 2], pads=[1, 1, 1, 1]
        )
        stages, inputs = [], 64
        for stage, (planes, blocks) in enumerate([(64, 3), (128, 4), (256, 6), (512, 3)]):
            for block in range(blocks):
                stride = 2 if stage > 0 and block == 0 else 1
                is_deformable = self.deformable and stage > 0
                tensor = self.bottleneck(tensor, inputs, planes, stride, is_deformable)
                inputs = 4 * planes
            stages.append(tensor)
        return stages[1:]

    def resized(self, tensor, channels, side):
        return self.node(
            "Resize",
            [tensor, "", "", self.constant([1, channels, side, side], np.int64)],
            mode="linear",
            coordinate_transformation_mode="pytorch_half_pixel",
        )

    def pyramid(self, stages):
        levels = []
        above = None
        for tensor, inputs, side in zip(reversed(stages), [2048, 1024, 512], [18, 35, 69]):
            tensor = self.conv(tensor, inputs, 256, relu=False, gain=0.7)
            if above is not None:
                tensor = self.node("Add", [tensor, self.resized(above, 256, side)])
            above = tensor
            levels.insert(0, tensor)
        levels = [self.conv(tensor, 256, 256, 3) for tensor in levels]
        for _ in range(2):
            levels.append(self.conv(levels[-1], 256, 256, 3, 2, relu=False))
        return levels

    def prototypes(self, tensor):
        for _ in range(3):
            tensor = self.conv(tensor, 256, 256, 3)
        tensor = self.resized(tensor, 256, 138)
        tensor = self.conv(tensor, 256, 256, 3)
        tensor = self.conv(tensor, 256, PROTOTYPES)
        return self.node("Transpose", [tensor], perm=[0, 2, 3, 1])

    def heads(self, levels, anchors):
        """The head that all levels of the published network share: same weights, other nodes."""
        parts = {"loc": 4, "conf": CLASSES + 1, "mask": PROTOTYPES}
        shared = self.weights(256, 256, 3, 1.0)
        weights = {key: self.weights(anchors * n, 256, 3, 0.5) for key, n in parts.items()}
        # A typical scale of the output of random layers.
        weights["conf"] *= 2.0
        names = {key: self.constant(values) for key, values in weights.items()}
        background = np.tile([4.0] + [0.0] * CLASSES, anchors)
        biases = {
            "loc": self.constant(np.zeros(anchors * 4)),
            "conf": self.constant(background),
            "mask": self.constant(np.zeros(anchors * PROTOTYPES)),
        }
        first, no_bias = self.constant(shared), self.constant(np.zeros(256))
        pieces = {key: [] for key in parts}
        for tensor, side in zip(levels, MAPS):
            same = {"kernel_shape": [3, 3], "pads": [1, 1, 1, 1]}
            tensor = self.node("Relu", [self.node("Conv", [tensor, first, no_bias], **same)])
            for key, columns in parts.items():
                head = self.node("Conv", [tensor, names[key], biases[key]], **same)
                head = self.node("Transpose", [head], perm=[0, 2, 3, 1])
                shape = self.constant([1, side * side * anchors, columns], np.int64)
                head = self.node("Reshape", [head, shape])
                pieces[key].append(self.node("Tanh", [head]) if key == "mask" else head)
        joined = {key: self.node("Concat", tensors, axis=1) for key, tensors in pieces.items()}
        joined["conf"] = self.node("Softmax", [joined["conf"]], axis=2)
        return joined

    def save(self, path, anchors):
        levels = self.pyramid(self.backbone())
        outputs = self.heads(levels, anchors)
        outputs["proto"] = self.prototypes(levels[0])
        rows = anchors * sum(side * side for side in MAPS)
        shapes = {
            "loc": [1, rows, 4],
            "conf": [1, rows, CLASSES + 1],
            "mask": [1, rows, PROTOTYPES],
            "proto": [1, 138, 138, PROTOTYPES],
        }
        values = []
        for key, shape in shapes.items():
            self.nodes.append(helper.make_node("Identity", [outputs[key]], [key], name=key))
            values.append(helper.make_tensor_value_info(key, TensorProto.FLOAT, shape))
        image = helper.make_tensor_value_info("input", TensorProto.FLOAT, [1, 3, SIDE, SIDE])
        graph = helper.make_graph(self.nodes, "yolact", [image], values, self.constants)
        opsets = [helper.make_opsetid("", 11), helper.make_opsetid("yolact", 1)]
        model = helper.make_model(graph, opset_imports=opsets)
        model.ir_version = 7
        onnx.save(model, path)


def main():
    os.makedirs(sys.argv[1], exist_ok=True)
    Network(deformable=False).save(os.path.join(sys.argv[1], "yolact_resnet50.onnx"), 3)
    Network(deformable=True).save(os.path.join(sys.argv[1], "yolact_plus_resnet50.onnx"), 9)


if __name__ == "__main__":
    main()
