#!/usr/bin/env python3
"""from_trial.py TRIAL OUT.csv: a recorded trial of tracked markers as another lab would hand it over.

Millimetres and milliseconds, y up and z towards the viewer; markers 0 and 1 are the held corners, the others dots on
the fabric with their place on it (across, down). Every second row of dots is kept, and 60 samples a second.
"""

import csv
import json
import pathlib
import sys


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def mm(value):
    return f"{1000 * float(value):.2f}"


def line(row, marker, x, y, z, across, down):
    return [f"{1000 * float(row['t_s']):.1f}", marker, mm(x), mm(z), mm(-float(y)), mm(across), mm(down)]


def main(trial, out):
    width = json.loads((trial / "trial.json").read_text())["fabric"]["width_m"]
    corners, dots = rows_of(trial / "corners.csv"), rows_of(trial / "markers.csv")
    every = round(1 / 60 / (float(corners[1]["t_s"]) - float(corners[0]["t_s"])))
    kept = {row["t_s"] for row in corners[::every]}
    lines = []
    for row in corners[::every]:
        lines.append(line(row, 0, row["left_x"], row["left_y"], row["left_z"], 0, 0))
        lines.append(line(row, 1, row["right_x"], row["right_y"], row["right_z"], width, 0))
    down = sorted({float(row["v_m"]) for row in dots})[1::2]
    number = {}
    for row in dots:
        if float(row["v_m"]) in down and row["t_s"] in kept:
            marker = number.setdefault(row["marker"], 2 + len(number))
            lines.append(line(row, marker, row["x"], row["y"], row["z"], row["u_m"], row["v_m"]))
    lines.sort(key=lambda cells: (float(cells[0]), int(cells[1])))
    with open(out, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["ms", "marker", "x", "y", "z", "across", "down"])
        writer.writerows(lines)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]), sys.argv[2])
