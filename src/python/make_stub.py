# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Writes the stub of the extension module beside it: make_stub.py PACKAGE_FOLDER

mypy's stubgen reads the signatures that pybind11 writes into docstrings. It does not know the star
before keyword-only arguments, takes prose for signatures, and keeps pybind11's names of types.
"""

import importlib
import pathlib
import re
import sys
import tempfile

import mypy.stubgen
import mypy.stubgenc

REPLACEMENTS = [
    (r"\bkeyword_only: Star", "*"),
    (r"(?m)^import dynfilter\n", ""),
    (r"\bdynfilter\.", ""),
    (r"numpy\.ndarray\[[\w.]+\]", "numpy.ndarray"),
    (r"\[int\[\d+\]\]", "[int]"),  # an array of fixed length
    (r"-> (Optional\[)?os\.PathLike", r"-> \1pathlib.Path"),
    (r"(?<=[ \[])os\.PathLike", "Union[str, os.PathLike]"),
    # Python iterates by such a member; checkers want the other one.
    (
        r"    def __getitem__\(self, \w+: int\) -> (\w+): ...",
        r"\g<0>\n    def __iter__(self) -> Iterator[\1]: ...",
    ),
]


def teach(stubgenc):
    """Lets stubgen look at pybind11's signatures alone: the first line, and numbered ones."""
    of_function = stubgenc.infer_sig_from_docstring
    of_property = stubgenc.infer_ret_type_sig_from_anon_docstring

    def signature(docstring, name):
        lines = (docstring or "").splitlines()
        lines = lines[:1] + [line for line in lines if re.match(r"\d+\. ", line)]
        lines = [line.replace(" *, ", " keyword_only: Star, ", 1) for line in lines]
        return of_function("\n".join(lines), name)

    def type_of_property(docstring):
        first = (docstring or "").split("\n")[0]
        return of_property(docstring) if " -> " in first else None

    stubgenc.infer_sig_from_docstring = signature
    stubgenc.infer_ret_type_sig_from_anon_docstring = type_of_property
    stubgenc.infer_prop_type_from_docstring = lambda docstring: None


def main(folder):
    teach(mypy.stubgenc)
    sys.path.insert(0, str(folder.parent))
    with tempfile.TemporaryDirectory() as out:
        mypy.stubgen.main(["--quiet", "--module", "dynfilter._dynfilter", "--output", out])
        text = (pathlib.Path(out) / "dynfilter" / "_dynfilter.pyi").read_text(encoding="utf-8")
    for kind in vars(importlib.import_module("dynfilter._dynfilter")).values():
        for name, member in vars(kind).items() if isinstance(kind, type) else ():
            if isinstance(member, staticmethod):  # stubgen takes it for a method
                signature = re.sub(r"= \w[^,)]*", "= ...", member.__func__.__doc__.split("\n")[0])
                text = text.replace(f"    def {name}(self, *args, **kwargs) -> Any: ...",
                                    f"    @staticmethod\n    def {signature}: ...")
    for pattern, replacement in REPLACEMENTS:
        text = re.sub(pattern, replacement, text)
    stub = "import os\nimport pathlib\nfrom typing import Iterator, Union\n\n__version__: str\n" + text
    (folder / "_dynfilter.pyi").write_text(stub, encoding="utf-8")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve())
