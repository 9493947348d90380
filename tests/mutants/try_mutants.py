#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

"""Runs the tests on each mutant of a build, and writes down which mutants they notice.

    try_mutants.py FOLDER EQUIVALENT JOBS

FOLDER holds table.txt (the mutants, by mutate.py) and build/ (the test programs). Each test first runs
without a mutant and says which mutants it reaches; only those tests can notice a mutant, and only they
try it. A test that fails then (it may need what ctest builds first) is named and left out. A line for
each mutant is added to FOLDER/results.txt: number, verdict, place, what was broken, the program that
noticed it. Mutants that have a line are left alone, so a stopped call goes on where it was.
"""

import concurrent.futures
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

# Tests as quick as that run in one process, program by program, before all others.
QUICK_SECONDS = 0.3
MUTANTS_MAX = 10000  # dynfilter_mutants_max of mutant.hpp


class Tests:
    """The tests of a build: how long each takes, and which mutants it reaches."""

    def __init__(self, folder, jobs):
        self.folder = folder
        programs = sorted(file for file in (folder / "build" / "tests").rglob("*_tests")
                          if file.is_file() and os.access(file, os.X_OK))
        (folder / "reached").mkdir(exist_ok=True)
        self.cases = []  # program, name, seconds, mutants
        left_out = []
        for program, cases in in_parallel(self.observe, programs, jobs):
            self.cases += [(program, name, seconds, set(mutants)) for name, seconds, mutants in cases
                           if mutants is not None]
            left_out += [f"{program.name} {name}" for name, _, mutants in cases if mutants is None]
        if left_out:
            print("left out, because they fail without a mutant:", *left_out, sep="\n  ", file=sys.stderr)
        if len(left_out) > 0.01 * len(self.cases):
            raise RuntimeError("too many tests fail without a mutant")

    def observe(self, program):
        """Runs each test of a program alone, without a mutant, or reads what an earlier call wrote."""
        known = self.folder / "reached" / (program.name + ".json")
        if known.exists() and known.stat().st_mtime > program.stat().st_mtime:
            return json.loads(known.read_text())
        cases = []
        with tempfile.NamedTemporaryFile(prefix="reached_") as reached:
            os.chmod(reached.name, 0o666)  # some tests give up the rights of root
            for name in listed(program):
                pathlib.Path(reached.name).write_bytes(bytes(MUTANTS_MAX))
                begin = time.monotonic()
                passed = self.passes(program, [name], program.name, {"DYNFILTER_MUTANTS_REACHED": reached.name}, 600)
                seconds = time.monotonic() - begin
                mutants = [number for number, byte in enumerate(pathlib.Path(reached.name).read_bytes()) if byte]
                cases.append([name, seconds, mutants if passed else None])
        known.write_text(json.dumps(cases))
        return cases

    def passes(self, program, names, place, variables, limit):
        """Runs tests in a folder of their own, because they may write where they run."""
        work = self.folder / "tried" / place
        work.mkdir(parents=True, exist_ok=True)
        environment = {**os.environ, "GTEST_FAIL_FAST": "1", **variables}
        process = subprocess.Popen([program, "--gtest_filter=" + ":".join(names)], cwd=work, env=environment,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL, start_new_session=True)
        try:
            passed = process.wait(limit) == 0
        except subprocess.TimeoutExpired:
            passed = False
        finally:
            end_group(process)
        shutil.rmtree(work, ignore_errors=True)
        return passed

    def reaching(self, number, file):
        """Yields program, tests and their seconds: programs named like the file first, then quick tests first."""
        groups = {}
        for program, name, seconds, mutants in self.cases:
            if number in mutants:
                names, times = groups.setdefault((program, seconds > QUICK_SECONDS), ([], []))
                names.append(name)
                times.append(seconds)
        stem = pathlib.Path(file).stem
        for (program, is_slow), (names, times) in sorted(
                groups.items(),
                key=lambda group: (group[0][1], not group[0][0].name.startswith(stem), sum(group[1][1]))):
            yield program, names, sum(times)

    def noticed_by(self, number, file):
        """Returns the name of a program whose tests fail with the mutant, twice, or nothing."""
        variables = {"DYNFILTER_MUTANT": str(number)}
        for program, names, seconds in self.reaching(number, file):
            limit = 10 * seconds + 10
            if not any(self.passes(program, names, str(number), variables, limit) for _ in range(2)):
                return program.name
        return None


def listed(program):
    """Returns the full names of the tests of a GoogleTest program."""
    names, suite = [], ""
    for line in subprocess.run([program, "--gtest_list_tests"], capture_output=True, text=True,
                               check=True).stdout.splitlines():
        text = line.split("#")[0].rstrip()
        if text.startswith("  "):
            names.append(suite + text.strip())
        elif text.endswith("."):
            suite = text
    return names


def end_group(process):
    """Ends what a test that was cut off has started."""
    try:
        os.killpg(process.pid, 9)
    except ProcessLookupError:
        pass
    process.wait()


def in_parallel(function, arguments, jobs):
    """Yields each argument and its result as soon as it is there. An error cancels what has not begun."""
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        calls = {pool.submit(function, argument): argument for argument in arguments}
        try:
            for call in concurrent.futures.as_completed(calls):
                yield calls[call], call.result()
        except BaseException:
            for call in calls:
                call.cancel()
            raise


def equivalents(file):
    """Returns the mutants that change nothing, as (file, what was broken)."""
    if not file.exists():
        return set()
    return {tuple(line.split("\t")[:2]) for line in file.read_text().splitlines() if not line.startswith("#")}


def main():
    folder, equivalent, jobs = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]), int(sys.argv[3])
    results = folder / "results.txt"
    results.touch()
    done = {int(line.split("\t")[0]) for line in results.read_text().splitlines()}
    change_nothing = equivalents(equivalent)
    tests = Tests(folder, jobs)

    def try_mutant(row):
        number, file, line, what = row.split("\t")
        if (file, what) in change_nothing:
            verdict, noticed = "equivalent", None
        else:
            noticed = tests.noticed_by(int(number), file)
            verdict = "caught" if noticed else "survived"
        return f"{number}\t{verdict}\t{file}:{line}\t{what}\t{noticed or '-'}\n"

    rows = [row for row in (folder / "table.txt").read_text().splitlines()
            if int(row.split("\t")[0]) not in done]
    for _, result in in_parallel(try_mutant, rows, jobs):
        with results.open("a") as file:
            file.write(result)


if __name__ == "__main__":
    try:
        main()
    except RuntimeError as error:
        sys.exit(f"error: {error}")
