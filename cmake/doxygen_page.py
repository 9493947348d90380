#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Prints a Markdown page of the repository as Doxygen wants it: doxygen_page.py PAGE

Doxygen does not know the anchors that GitHub gives to headings. So each heading gets a label, and
links between the pages refer to these labels. Links to files that are no pages become text. Nor does
it see that text is bold which begins with code or a quotation mark.
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
CODE_OR_BOLD = re.compile(r"(`[^`]*`)|\*\*(?=\S)((?:[^*`]|`[^`]*`)+)\*\*")
LINK = re.compile(r"(!?)\[((?:[^][]|\[[^]]*\])*)\]\(([^()\s]+)\)")


def label(page, anchor):
    """Returns Doxygen's label of a page, or of a heading on it; the main page's is given."""
    is_made = ROOT not in page.parents or "build" in page.relative_to(ROOT).parts
    name = page.stem if is_made else str(page.relative_to(ROOT).with_suffix(""))
    if name == "README" and not anchor:
        return "index"
    return "-".join(re.findall(r"\w+", "page " + name + " " + anchor))


def anchor_of(heading):
    """Returns the anchor that GitHub gives to a heading."""
    text = LINK.sub(r"\2", heading).strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def linked(match, page):
    is_image, text, target = match.groups()
    if "://" in target:
        return match.group()
    if is_image:  # Doxygen knows pictures by their names alone
        return f"![{text}]({pathlib.PurePosixPath(target).name})"
    path, _, anchor = target.partition("#")
    file = (page.parent / path).resolve() if path else page
    if file.suffix != ".md" or ".github" in file.parts:  # is not among Doxygen's pages
        return text
    return f"[{text}](@ref {label(file, anchor)})"


def main():
    page = pathlib.Path(sys.argv[1]).resolve()
    is_code, is_title, used = False, True, {}
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.lstrip().startswith("```"):
            is_code = not is_code
        heading = None if is_code else re.match(r"(#+) (.*)", line)
        if heading:
            anchor = anchor_of(heading[2])
            used[anchor] = used.get(anchor, -1) + 1
            anchor += f"-{used[anchor]}" if used[anchor] else ""
            name = label(page, "" if is_title else anchor)
            line = f"{heading[1]} {heading[2]}" + (f" {{#{name}}}" if name != "index" else "")
            is_title = False
        elif not is_code:
            line = LINK.sub(lambda match: linked(match, page), line)
            line = CODE_OR_BOLD.sub(lambda match: match[1] or f"<b>{match[2]}</b>", line)
        print(line)


if __name__ == "__main__":
    main()
