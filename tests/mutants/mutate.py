#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

"""Breaks a copy of the sources in many small ways, each switched by a number at run time.

    mutate.py COPY COUNT TABLE [FILES]

Rewrites files under COPY/include and COPY/src: an expression becomes
`(dynfilter_mutant(17) ? broken : expression)`. Chooses COUNT places, spread evenly over the files,
and writes a line for each to TABLE: number, file, line, what was broken. FILES is a regular
expression for their names. Text only: it leaves alone
what it does not understand, and what the compiler computes.
"""

import hashlib
import pathlib
import re
import sys

OPERAND = r"[A-Za-z0-9_.:]+(?:\[[A-Za-z0-9_.]+\]|\([A-Za-z0-9_., ]*\)|->[A-Za-z0-9_]+|\.[A-Za-z0-9_]+)*"
BEFORE = r"(?<=\()|(?<=&& )|(?<=\|\| )|(?<=return )|(?<=; )|(?<=\? )"
AFTER = r"(?=\)|;| &&| \|\|)"
COMPARISON = re.compile(f"(?:{BEFORE})({OPERAND}) (<=|>=|<|>|==|!=) (-?{OPERAND}){AFTER}")
BROKEN = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
CHECK = re.compile(r"^( *if )(\(.*\))( (?:return|continue|break|throw|detail::throw|throw_).*;)$")
ONE = re.compile(r" ([+-]) 1(?=[;,)\]])")
EXTREME = re.compile(r"std::(min|max)\((?!\{|std::|\))")
VERDICT = re.compile(r"\breturn (true|false);")
RAW_BEGIN = re.compile(r'R"\((?!.*\)")')
# Computed by the compiler, read by it as text, or no code.
LEFT_ALONE = re.compile(
    r"constexpr|static_assert|template|\bcase\b|noexcept|using |^\s*(#|//|\*|struct|class|enum)|operator|\[\[|decltype|sizeof|asm|_mm")


def is_balanced(text):
    depth = 0
    for letter in text:
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if depth < 0:
            return False
    return depth == 0


def comparison(match, number):
    left, operator, right = match.groups()
    if not is_balanced(left) or not is_balanced(right):
        return None
    return (f"(dynfilter_mutant({number}) ? {left} {BROKEN[operator]} {right} : {left} {operator} {right})",
            f"{operator} becomes {BROKEN[operator]}")


def check(match, number):
    head, condition, rest = match.groups()
    if not is_balanced(condition) or re.search(r"[^=!<>]=[^=]|;", condition) or not is_balanced(condition[1:-1]):
        return None
    return (f"{head}(!dynfilter_mutant({number}) && static_cast<bool>{condition}){rest}",
            "the check is removed")


def one(match, number):
    return f" {match[1]} (dynfilter_mutant({number}) ? 0 : 1)", f"{match[0].strip()} is dropped"


def extreme(match, number):
    return f"dynfilter_mutant_{match[1]}({number}, ", f"{match[1]} becomes the other"


def verdict(match, number):
    return (f"return {'!' if match[1] == 'true' else ''}dynfilter_mutant({number});",
            f"{match[1]} becomes the other")


KINDS = [(COMPARISON, comparison), (CHECK, check), (ONE, one), (EXTREME, extreme), (VERDICT, verdict)]


def places(lines):
    """Yields line, position and kind of each place that can be broken."""
    constant_indent = None  # within a constexpr function
    is_text = False  # within a raw string
    for number, line in enumerate(lines):
        was_text = is_text
        is_text = RAW_BEGIN.search(line) is not None or (was_text and ')"' not in line)
        if was_text:
            continue
        indent = len(line) - len(line.lstrip())
        if constant_indent is not None:
            if line.strip() and indent <= constant_indent and line.strip().startswith("}"):
                constant_indent = None
            continue
        if "constexpr" in line and line.rstrip().endswith("{") and "if constexpr" not in line:
            constant_indent = indent
            continue
        code = line.split("//")[0].rstrip("\n")
        if LEFT_ALONE.search(code) or '"' in code or "'" in code:
            continue
        for pattern, broken in KINDS:
            for match in pattern.finditer(code):
                if broken(match, 0):
                    yield number, match.start(), pattern, broken


def lot(*texts):
    """Draws a number by lot that is always the same for the same texts."""
    return hashlib.sha256("\0".join(texts).encode()).digest()


def chosen_places(copy, files, count):
    """Takes a place of each file in turn, drawn by lot, until there are `count`.

    The lot depends on the file's name and the line's text alone, so that a change of the code leaves most of the
    others in the table.
    """
    left = {}
    for file in sorted(files, key=lambda file: lot(str(file.relative_to(copy)))):
        lines = file.read_text().splitlines(True)
        found = sorted(places(lines), key=lambda place: lot(file.name, lines[place[0]].strip(), str(place[1]),
                                                            place[2].pattern))
        if found:
            left[file] = found
    chosen = []
    while left and len(chosen) < count:
        for file in list(left):
            if len(chosen) == count:
                break
            # One place a line: the rewriting of one must not move another.
            place = left[file].pop()
            if all((file, place[0]) != (other, taken[0]) for other, taken in chosen):
                chosen.append((file, place))
            if not left[file]:
                del left[file]
    return chosen


def main():
    copy, count, table = pathlib.Path(sys.argv[1]), int(sys.argv[2]), pathlib.Path(sys.argv[3])
    wanted = sys.argv[4] if len(sys.argv) > 4 else ""
    files = sorted(file for folder in ("include", "src") for file in (copy / folder).rglob("*.?pp")
                   if "python" not in file.parts and "kernels" not in file.parts
                   and re.search(wanted, str(file.relative_to(copy))))
    rows = []
    chosen = chosen_places(copy, files, count)
    for number, (file, (line, start, pattern, broken)) in enumerate(chosen, 1):
        lines = file.read_text().splitlines(True)
        match = pattern.search(lines[line].rstrip("\n"), 0 if pattern is CHECK else start)
        text, what = broken(match, number)
        old = lines[line]
        lines[line] = old[:match.start()] + text + old[match.end():]
        file.write_text("".join(lines))
        rows.append(f"{number}\t{file.relative_to(copy)}\t{line + 1}\t{what}: {old.strip()}\n")
    table.write_text("".join(rows))
    print(f"{len(rows)} mutants in {len({row.split(chr(9))[1] for row in rows})} files")


if __name__ == "__main__":
    main()
