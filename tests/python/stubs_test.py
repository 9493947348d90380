# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""The type stubs say what the module has: names, members, parameters and defaults."""

import ast
import inspect
import pathlib
import re

import dynfilter

FOLDER = pathlib.Path(dynfilter.__file__).parent
STUB = ast.parse(
    "".join(
        (FOLDER / name).read_text() for name in ("_options.pyi", "_results.pyi", "__init__.pyi")
    )
)
NETWORKS = {"NetworkSegmenter", "YoloSegmenter", "YolactSegmenter"}  # where OpenCV has dnn


def definitions(body):
    """Names that a body defines, with their nodes: classes, functions, annotated names."""
    found = {}
    for node in body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            found[node.name] = node
        elif isinstance(node, ast.AnnAssign):
            found[node.target.id] = node
        elif isinstance(node, ast.Assign):
            found.update({target.id: node for target in node.targets})
    return found


def parameters(function):
    """Parameters of a stub: names, those that are only keywords marked by a star, with defaults."""
    arguments = function.args
    plain = [a.arg for a in arguments.args if a.arg not in ("self", "cls")]
    defaults = [None] * (len(plain) - len(arguments.defaults)) + arguments.defaults
    result = [(name, default is not None) for name, default in zip(plain, defaults)]
    if arguments.vararg:
        result.append(("*" + arguments.vararg.arg, False))
    result += [
        ("*" + a.arg, d is not None) for a, d in zip(arguments.kwonlyargs, arguments.kw_defaults)
    ]
    return result


def real_parameters(function):
    """The same from the first line of the docstring."""
    line = function.__doc__.splitlines()[0]
    inner = re.match(r"\w+\((.*)\)( -> .*)?$", line).group(1)
    inner = re.sub(r"= \[[^\[\]]*\]", "= list", inner)
    inner = re.sub(r"\[[^\[\]]*(\[[^\[\]]*\][^\[\]]*)*\]", "", inner)  # commas of types and lists
    inner = re.sub(r"= \([^()]*\)", "= tuple", inner)
    inner = re.sub(r"\w+\(\)", "call", inner)
    result, star = [], ""
    for part in filter(None, (p.strip() for p in inner.split(","))):
        name = re.match(r"[*\w]+", part).group(0)
        if name == "self":
            continue
        if name == "*":
            star = "*"
        elif name == "*args":
            result.append(("*columns", False))
            star = "*"
        else:
            result.append((star + name, " = " in part))
    return result


def public(names):
    return {name for name in names if not name.startswith("_")}


def test_names_are_those_of_the_module():
    assert public(definitions(STUB.body)) - NETWORKS == set(dynfilter.__all__) - NETWORKS


def test_members_are_those_of_the_classes():
    for name, node in definitions(STUB.body).items():
        if isinstance(node, ast.ClassDef) and name in dynfilter.__all__:
            real = public(vars(getattr(dynfilter, name)))
            only_here = {"name", "value", "do_segment"}  # of enumerations, and of derived classes
            assert public(definitions(node.body)) - only_here == real - only_here, name


def test_parameters_are_those_of_the_functions():
    checked = 0
    for name, node in definitions(STUB.body).items():
        value = getattr(dynfilter, name, None)
        if isinstance(node, ast.FunctionDef):
            assert parameters(node) == real_parameters(value), name
            checked += 1
        if not isinstance(node, ast.ClassDef) or name not in dynfilter.__all__:
            continue
        for member, function in definitions(node.body).items():
            if not isinstance(function, ast.FunctionDef) or name.endswith("Options"):
                continue
            if any(getattr(d, "id", "") == "property" for d in function.decorator_list):
                continue
            real = inspect.getattr_static(value, member, None)
            if real is None or member == "__iter__" or member == "do_segment":
                continue
            real = getattr(value, member)
            if member.startswith("__") and member != "__init__":
                continue
            assert parameters(function) == real_parameters(real), f"{name}.{member}"
            checked += 1
    assert checked > 40


def test_options_list_their_fields():
    for name, node in definitions(STUB.body).items():
        if not name.endswith("Options"):
            continue
        fields = definitions(node.body)
        init = fields.pop("__init__")
        names = [p.lstrip("*") for p, _ in parameters(init)]
        assert names == list(public(fields)) or set(names) == public(fields), name
        assert repr(getattr(dynfilter, name)()).startswith(f"{name}({names[0]}=")
        for field in names:
            assert hasattr(getattr(dynfilter, name)(), field)
