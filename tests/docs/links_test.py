#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Tests links.py: pages in order pass, and each kind of fault is found."""

import pathlib
import subprocess
import sys
import tempfile

CHECK = pathlib.Path(__file__).with_name("links.py")
NAMES = [f"page-{k}" for k in range(8)]


def complaint(changes):
    """Returns what the check says of a folder of pages in order with these changes."""
    pages = {name: '<h1 id="top">A page</h1><code>](x)</code>' for name in NAMES}
    pages["index"] = "".join(f'<a href="{name}.html#top">x</a>' for name in NAMES)
    pages.update(changes)
    with tempfile.TemporaryDirectory() as folder:
        for name, text in pages.items():
            (pathlib.Path(folder) / f"{name}.html").write_text(text, encoding="utf-8")
        done = subprocess.run(
            [sys.executable, CHECK, folder], check=False, capture_output=True, text=True
        )
    return done.stderr if done.returncode else ""


def expect(found, wanted):
    if wanted not in found or (not wanted and found):
        sys.exit(f"wanted {wanted!r}, got {found!r}")


expect(complaint({}), "")
expect(complaint({"page-1": '<a href="nowhere.html">x</a><b id="top">'}), "leads to no file")
expect(complaint({"page-1": '<a href="page-2.html#x">x</a><b id="top">'}), "leads to no place")
expect(complaint({"page-8": "alone"}), "page-8.html is out of reach")
expect(complaint({"page-1": '<b id="top">[a](b.md)</b>'}), "shows Markdown: [a](b.md)")
expect(complaint({"page-1": '<b id="top">**a</b><code>x ** y</code>'}), "shows Markdown: **a")
