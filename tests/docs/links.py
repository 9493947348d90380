#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Checks the web pages of the target `docs`: links.py FOLDER

No link leads nowhere, each of the repository's pages can be reached from the first page, and no page
shows Markdown's signs of a link or of bold text.
"""

import html.parser
import pathlib
import re
import sys
import urllib.parse

# Doxygen announces a class's private classes in its summary, and does not list them.
OF_DOXYGEN = {"nested-classes"}

CODE = {"code", "pre", "script", "style"}


class Page(html.parser.HTMLParser):
    """Links and anchors of a page, and its text outside code."""

    def __init__(self, file):
        super().__init__()
        self.links, self.anchors, self.text = [], set(), ""
        self.in_code = self.in_block = 0  # depth of tags: of code, and of Doxygen's blocks of code
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.links += [given[name] for name in ("href", "src") if given.get(name)]
        self.anchors |= {given[name] for name in ("id", "name") if given.get(name)}
        self.in_code += tag in CODE
        self.in_block += tag == "div" and (self.in_block > 0 or given.get("class") == "fragment")

    def handle_endtag(self, tag):
        self.in_code -= tag in CODE and self.in_code > 0
        self.in_block -= tag == "div" and self.in_block > 0

    def handle_data(self, data):
        if not self.in_code and not self.in_block:
            self.text += data


def targets(folder, file, page):
    """Yields the file and the anchor of each link to a page of the folder."""
    for link in page.links:
        parts = urllib.parse.urlsplit(link)
        if parts.scheme or link.startswith("//"):
            continue
        path = urllib.parse.unquote(parts.path)
        target = (folder / path).resolve() if path else file
        yield link, target, urllib.parse.unquote(parts.fragment)


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    pages = {file: Page(file) for file in sorted(folder.glob("*.html"))}
    if folder / "index.html" not in pages:
        sys.exit(f"{folder} has no index.html: build the target docs first")
    wrong, reached, waiting = [], set(), [folder / "index.html"]
    while waiting:
        file = waiting.pop()
        if file in reached or file not in pages:
            continue
        reached.add(file)
        waiting += [target for _, target, _ in targets(folder, file, pages[file])]
    for file, page in pages.items():
        for link, target, anchor in targets(folder, file, page):
            if not target.is_file():
                wrong.append(f"{file.name}: {link} leads to no file")
            elif target in pages and anchor and anchor not in pages[target].anchors | OF_DOXYGEN:
                wrong.append(f"{file.name}: {link} leads to no place on its page")
    repositorys = [file for file in pages if file.name.startswith("page-")]
    if len(repositorys) < 8:
        wrong.append(f"only {len(repositorys)} of the repository's pages are there")
    wrong += [f"{file.name} is out of reach" for file in repositorys if file not in reached]
    for file in repositorys + [folder / "index.html"]:
        for sign in re.findall(r"\S*\]\(\S*|\{#\S*|\S*\*\*\S*", pages[file].text):
            wrong.append(f"{file.name} shows Markdown: {sign}")
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"{len(pages)} pages, and every link leads somewhere")


if __name__ == "__main__":
    main()
