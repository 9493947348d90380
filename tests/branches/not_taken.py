#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

"""Prints the outcomes of conditions that no test brought about and that have no reason.

    not_taken.py COVERAGE REPOSITORY BEGINNING

COVERAGE is what `llvm-cov export` prints. REPOSITORY/tests/branches/files.txt has the files to look
at, patterns of the shell, and reasons.txt the outcomes that need no test: file, condition and
outcome, reason, separated by tabs. Only files whose names begin with BEGINNING count. The last line counts; the exit code is 1 if one has no reason,
or if a reason is for an outcome that a test brought about.
"""

import collections
import fnmatch
import json
import os
import pathlib
import sys


def rows_of(page):
    """Returns the lines of a file that are neither empty nor comments."""
    return [line for line in page.read_text().splitlines() if line and not line.startswith("#")]


def outcomes_of(branches):
    """Returns how often each condition was true and false, by its place: copies of a template count together."""
    counts = collections.defaultdict(lambda: [0, 0])
    for line, column, end_line, end_column, if_true, if_false, *_ in branches:
        counts[line, column, end_line, end_column][0] += if_true
        counts[line, column, end_line, end_column][1] += if_false
    return counts


def text_between(lines, place):
    line, column, end_line, end_column = place
    if line == end_line:
        return lines[line - 1][column - 1:end_column - 1]
    text = [lines[line - 1][column - 1:], *lines[line:end_line - 1], lines[end_line - 1][:end_column - 1]]
    return " ".join(part.strip() for part in text)


def main():
    coverage, root = json.loads(pathlib.Path(sys.argv[1]).read_text()), pathlib.Path(sys.argv[2])
    beginning = sys.argv[3]
    patterns = rows_of(root / "tests/branches/files.txt")
    reasons = {tuple(row.split("\t")[:2]) for row in rows_of(root / "tests/branches/reasons.txt")
               if row.startswith(beginning)}
    everything = taken = 0
    missing, used = [], set()
    for file in coverage["data"][0]["files"]:
        name = os.path.relpath(file["filename"], root)  # it may go up from the folder of the build
        if not name.startswith(beginning) or not any(fnmatch.fnmatch(name, pattern) for pattern in patterns):
            continue
        lines = (root / name).read_text().splitlines()
        for place, counts in sorted(outcomes_of(file["branches"]).items()):
            for outcome, count in zip(("true", "false"), counts):
                everything += 1
                if count > 0:
                    taken += 1
                    continue
                key = (name, f"{text_between(lines, place)} is {outcome}")
                if key in reasons:
                    used.add(key)
                else:
                    missing.append(f"{name}:{place[0]}\t{key[1]}")
    print("\n".join(missing))
    idle = sorted(reasons - used)
    for name, what in idle:
        print(f"a reason that is not needed: {name}\t{what}")
    print(f"{taken} of {everything}; {len(used)} have a reason")
    sys.exit(1 if missing or idle else 0)


if __name__ == "__main__":
    main()
