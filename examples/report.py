#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT
"""Shows results of `dynfilter run` or `dynfilter ablate` as one HTML file.

usage: report.py RESULTS PAGE

Shows a table and bars of the rules, a map of the trajectories, courses over time, and the worst frames.
Bars, table and worst frames are of all scenes of a group, paths and courses of its first one. Drawings
are vector graphics, which a browser saves as SVG.
"""

import base64
import csv
import html
import io
import json
import pathlib
import sys

try:
    import matplotlib.pyplot as plt
    import numpy as np
except ImportError as error:
    sys.exit(f"report.py: {error}; install python3-matplotlib and python3-numpy")

ORDER = ["none", "mask", "paper", "depth"]  # further rules follow by name, and perfect comes last
STYLE = """body { font: 16px/1.5 sans-serif; max-width: 1060px; margin: 2em auto; padding: 0 1em; color: #222; }
img { max-width: 100%; } figure { margin: 0; } .row { display: flex; flex-wrap: wrap; gap: 1.5em; }
.row figure { width: 100%; } .row img { width: 100%; } td, th { padding: 0 1em 0 0; text-align: right; }
td:first-child, th:first-child { text-align: left; } figcaption { font-size: 85%; color: #555; }"""
plt.switch_backend("Agg")  # needs no screen
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
                     "axes.grid": True, "grid.color": "#e5e5e5", "axes.axisbelow": True,
                     "figure.constrained_layout.use": True})


class Run:
    """The results in one folder."""

    def __init__(self, folder):
        self.folder = folder
        self.summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        self.group, self.scene, self.rule = (self.summary[key] for key in ("group", "scene", "rule"))
        with open(folder / "frames.csv", encoding="utf-8", newline="") as file:
            self.rows = list(csv.DictReader(file))
        self.start_s = float(self.rows[0]["timestamp_s"])
        self.truth = read_poses(folder / "groundtruth.txt")
        self.estimate, self.errors_m = on_truth(read_poses(folder / "trajectory.txt"), self.truth)

    def column(self, name):
        """Returns a number for each frame, NaN where it is not known."""
        return np.array([float(row[name] or "nan") for row in self.rows])

    def per_frame(self, key):
        return self.summary[key] / self.summary["frames"] if key in self.summary else np.nan


def read_poses(file):
    """Returns rows of time, x, y and z; none without a file."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    return np.array([line.split()[:4] for line in lines if line and line[0] != "#"], float).reshape(-1, 4)


def rank(rule):
    return (rule == "perfect", ORDER.index(rule) if rule in ORDER else len(ORDER), rule)


def read_runs(folder):
    """Returns the runs below a folder by group, scene and rule."""
    files = [file for file in sorted(folder.rglob("summary.json")) if "/." not in f"/{file.relative_to(folder)}"]
    if not files:
        sys.exit(f"{folder}: holds no results: there is no summary.json in it, at any depth")
    groups = {}
    for run in map(Run, (file.parent for file in files)):
        groups.setdefault(run.group, {}).setdefault(run.scene, {})[run.rule] = run
    return {group: {scene: [runs[rule] for rule in sorted(runs, key=rank)] for scene, runs in scenes.items()}
            for group, scenes in groups.items()}


def on_truth(estimate, truth):
    """Returns the estimate, moved rigidly to the truth if there is one, and its errors, metres or NaN."""
    errors_m = np.full(len(estimate), np.nan)
    if len(truth) < 3 or len(estimate) < 3:
        return estimate, errors_m
    differences_s = np.abs(truth[:, :1] - estimate[:, 0])
    found = differences_s.min(0) < 0.02
    a, b = estimate[found, 1:], truth[differences_s.argmin(0)[found], 1:]
    u, _, v = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    moved = (estimate[:, 1:] - a.mean(0)) @ turn.T + b.mean(0)
    errors_m[found] = np.linalg.norm(moved[found] - b, axis=1)
    return np.column_stack([estimate[:, 0], moved]), errors_m


def embedded(data):
    kind = "jpeg" if data.startswith(b"\xff\xd8") else "svg+xml"
    return f'<img alt="" src="data:image/{kind};base64,{base64.b64encode(data).decode()}">'


def picture(figure):
    """Returns a figure of matplotlib as an element of HTML."""
    data = io.BytesIO()
    figure.savefig(data, format="svg")
    plt.close(figure)
    return embedded(data.getvalue())


def colours(rules):
    """Returns a colour for each rule, the same in all pictures."""
    cycle = plt.get_cmap("tab10" if len(rules) <= 10 else "tab20").colors
    others = [rule for rule in rules if rule not in ("none", "perfect")]
    return {"none": "#999", "perfect": "#222", **{rule: cycle[i % len(cycle)] for i, rule in enumerate(others)}}


def setting_line(summary):
    """Names what made the results."""
    settings = [f"{name} {value}" for name, value in summary.get("options", {}).items()]
    return f"<p>dynfilter {html.escape(', '.join([summary.get('version', ''), *settings]))}</p>"


def table(rules, values, spreads):
    """Returns a table with a row a rule: medians, and quartiles where there are several runs."""
    rows = [f"<tr><th>rule</th>{''.join(f'<th>{name}</th>' for name in values)}</tr>"]
    for i, rule in enumerate(rules):
        cells = ""
        for name, column in values.items():
            low, high = spreads[name][i]
            low, high, middle = (f"{value:.0f}" if value >= 100 else f"{value:.3g}" for value in (low, high, column[i]))
            cells += f"<td>{middle}{f' ({low}..{high})' if low != high else ''}</td>"
        rows.append(f"<tr><td>{html.escape(rule)}</td>{cells}</tr>")
    return f"<table>{''.join(rows)}</table>"


def bars(scenes, colour):
    """Draws a bar for each rule, medians over the runs of a group, and adds them as a table."""
    rules = sorted({run.rule for runs in scenes.values() for run in runs}, key=rank)
    figures = {"dynamic left a frame": lambda run: run.per_frame("dynamic_left"),
               "static removed a frame": lambda run: run.per_frame("static_removed"),
               "kept a frame": lambda run: run.per_frame("kept"),
               "ATE (RMSE), m": lambda run: run.summary.get("ate_rmse_m", np.nan),
               "frames lost, %": lambda run: 100 * run.per_frame("lost_frames")}
    found = {name: [[get(run) for runs in scenes.values() for run in runs if run.rule == rule] for rule in rules]
             for name, get in figures.items()}
    values = {name: [np.median(column) for column in columns] for name, columns in found.items()}
    spreads = {name: [np.quantile(column, (0.25, 0.75)) for column in columns] for name, columns in found.items()}
    values = {name: column for name, column in values.items() if not np.isnan(column).all()}
    figure, panels = plt.subplots(1, len(values), figsize=(10, 0.7 + 0.27 * len(rules)), sharey=True, squeeze=False)
    for axes, (name, column) in zip(panels[0], values.items()):
        shown = axes.barh(rules, column, color=[colour[rule] for rule in rules], height=0.7)
        axes.bar_label(shown, [f"{value:.3g}" for value in column], padding=2, fontsize=8)
        axes.set_title(name, fontsize=9)
        most, least = np.nanmax(column), np.nanmin(column)
        if name.startswith("ATE") and most > 10 * least > 0:  # short bars would look alike
            axes.set(xscale="log", xlim=(least / 2, 4 * most))
        else:
            axes.set_xlim(0, 1.3 * (most or 1))
            axes.locator_params(axis="x", nbins=3)
        axes.grid(axis="y", visible=False)
    panels[0][0].invert_yaxis()
    return picture(figure) + table(rules, values, spreads)


def trajectories(runs, colour):
    """Draws the two axes along which the camera moves most."""
    tracked = [run for run in runs if len(run.estimate) > 1]
    if not tracked:
        return ""
    path = max((run.truth if len(run.truth) else run.estimate for run in tracked), key=len)[:, 1:]
    first, second = sorted(np.argsort(np.ptp(path, axis=0))[1:])
    figure, axes = plt.subplots(figsize=(7, 5))
    if len(tracked[0].truth):
        axes.plot(path[:, first], path[:, second], color="black", lw=3, alpha=0.25, label="truth")
    for run in tracked:
        x_m, y_m = run.estimate[:, 1 + first], run.estimate[:, 1 + second]
        axes.plot(x_m, y_m, color=colour[run.rule], lw=1.2, label=run.rule)
    axes.set(xlabel="xyz"[first] + ", m", ylabel="xyz"[second] + ", m")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
    return "<h3>The camera's path</h3>" + picture(figure)


def courses(runs, colour):
    """Draws features and the camera's error over time."""
    series = {"dynamic features left": lambda run: run.column("dynamic_left"),
              "features kept": lambda run: run.column("kept"), "camera off by, m": lambda run: run.errors_m}
    series = {name: get for name, get in series.items() if any(np.isfinite(get(run)).any() for run in runs)}
    figure, axes = plt.subplots(len(series), 1, figsize=(10, 1.9 * len(series)), sharex=True, squeeze=False)
    for panel, (name, get) in zip(axes[:, 0], series.items()):
        for run in runs:
            times_s = run.estimate[:, 0] if name.startswith("camera") else run.column("timestamp_s")
            panel.plot(times_s - run.start_s, get(run), color=colour[run.rule], lw=1.1, label=run.rule)
        panel.set(ylabel=name, ylim=(0, None))
        off_m = [np.nanmedian(run.errors_m) for run in runs if np.isfinite(run.errors_m).any()]
        if name.startswith("camera") and off_m and max(off_m) > 10 * min(off_m):
            panel.set(yscale="log", ylim=(min(off_m) / 10, None))
    axes[-1, 0].set_xlabel("time, s")
    axes[0, 0].legend(fontsize=8, ncol=8, loc="lower left", bbox_to_anchor=(0, 1), frameon=False)
    return "<h3>Over time</h3>" + picture(figure)


def badness(run):
    """Returns how bad each frame is: by dynamic features left, else by how few are kept."""
    left = run.column("dynamic_left")
    return -run.column("kept") if np.isnan(left).all() else left


def worst_frames(scenes):
    """Names each rule's worst frames in the scene that has the worst one, and shows that."""
    figures = []
    for rule in sorted({run.rule for runs in scenes.values() for run in runs}, key=rank):
        run = max((run for runs in scenes.values() for run in runs if run.rule == rule),
                  key=lambda run: badness(run).max())
        key = "kept" if np.isnan(run.column("dynamic_left")).all() else "dynamic_left"
        worst = np.argsort(-badness(run), kind="stable")[:3]
        names = ", ".join(f"{html.escape(run.rows[i]['frame'])} ({run.rows[i][key]} {key.replace('_', ' ')})"
                          for i in worst)
        file = run.folder / "worst_frame.jpg"
        shown = embedded(file.read_bytes()) if file.is_file() else ""
        figures.append(f"<figure>{shown}<figcaption><b>{html.escape(rule)}</b>: {names} of {html.escape(run.scene)}</figcaption></figure>")
    return '<h3>The worst frames</h3><div class="row">' + "".join(figures) + "</div>"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder, page = map(pathlib.Path, sys.argv[1:])
    groups = read_runs(folder)
    colour = colours(sorted({run.rule for g in groups.values() for runs in g.values() for run in runs}, key=rank))
    parts = [f"<!DOCTYPE html><html lang=en><meta charset=utf-8><title>dynfilter</title><style>{STYLE}</style>"]
    for group, scenes in groups.items():
        scene, runs = next(iter(scenes.items()))
        count = "" if len(scenes) == 1 else f", medians over {len(scenes)} runs; further pictures: {scene}"
        parts += [f"<h2>{html.escape(group + count)}</h2>", setting_line(runs[0].summary), bars(scenes, colour),
                  trajectories(runs, colour), courses(runs, colour), worst_frames(scenes)]
    page.write_text("\n".join(parts) + "</html>\n", encoding="utf-8")
    print(f"{page}: {sum(map(len, groups.values()))} runs of each rule in {len(groups)} groups")


if __name__ == "__main__":
    main()
