#!/usr/bin/env python3
"""draw_effects.py OUT: what each effect of the library does to a swatch, one SVG an effect.

    PYTHONPATH=build/python python3 docs/pictures/draw_effects.py docs/pictures/effects

A swatch of 0.3 x 0.3 m hangs by its upper corners; the right one is waved towards the viewer and back. Grey: without
the effect. Blue: with it, so large that it shows. What is of the fabric, the air or the grips is simulated
(selvedge.simulate); what is of the measurement is done to the motion as it is seen. Exit status 1 where an effect of
the library has no picture here.
"""

import pathlib
import sys

import numpy as np
import selvedge

SIZE_M, LINES, TIME_S = 0.3, 9, 1.0
TIMES = np.arange(0, 1.2001, 1 / 60)
AT = int(round(TIME_S * 60))
UV = np.array([(SIZE_M * c / (LINES - 1), SIZE_M * r / (LINES - 1)) for r in range(LINES) for c in range(LINES)])
CAMERA = np.array([0.0, -0.9, -0.15])

# A soft, light knit, so that what is small on other fabrics shows.
KNIT = {"density": 0.15, "stretch": 40, "shear": 25, "bend": 2e-5, "stretch_damping": 0.02, "shear_damping": 0.02,
        "bend_damping": 2e-7, "drag_normal": 1.0, "drag_tangent": 0.05, "drag_fade": 0.2}


def path():
    """Of the held corners: the right one swings across the fabric."""
    ramp = np.clip(TIMES / 0.25, 0, 1)
    swing = 0.06 * ramp**2 * (3 - 2 * ramp) * np.sin(2 * np.pi * 1.3 * TIMES)
    zero = np.zeros_like(TIMES)
    return (np.column_stack([zero - 0.1425, zero, zero]), np.column_stack([zero + 0.1425, swing, zero]))


def motion(material=None, left_by=0, right_by=0, **other):
    """Points of the fabric over time, (T, LINES², 3)."""
    left, right = path()
    fabric = selvedge.Material(**(KNIT | (material or {})))
    options = {"cells": 12, "progress": False} | other
    return selvedge.simulate(fabric, width_m=SIZE_M, height_m=SIZE_M, time_s=TIMES, left=left + left_by,
                             right=right + right_by, **options).points(UV)


def of_material(**material):
    return lambda seen: motion(material)[AT]


def slipped():
    """The right grip lets go of the fabric in proportion to its way."""
    _, right = path()
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(right, axis=0), axis=1))])
    return 0.15 * way[:, None] * np.array([-0.7, 0, -0.7])


def at_times(seen, times):
    """Each point at a time of its own (or all at one)."""
    times = np.broadcast_to(times, seen.shape[1])
    return np.array([[np.interp(t, TIMES, seen[:, i, a]) for a in range(3)] for i, t in enumerate(times)])


def grid(points):
    return points.reshape(LINES, LINES, 3)


def evenly_between_edges(points):
    """Nodes spaced evenly as seen, along straight lines from edge to edge."""
    rows, share = grid(points), np.linspace(0, 1, LINES)[None, :, None]
    return ((1 - share) * rows[:, :1] + share * rows[:, -1:]).reshape(-1, 3)


def distorted(points):
    """Radial distortion of a picture about its middle."""
    middle = np.array([0, 0, -0.15])
    off = (points - middle)[:, [0, 2]]
    factor = 1 + 3 * np.sum(off**2, axis=1)
    out = points.copy()
    out[:, [0, 2]] = middle[[0, 2]] + off * factor[:, None]
    return out


def eroded(points):
    middle = points.mean(axis=0)
    inward = middle - points
    return points + 0.012 * inward / np.linalg.norm(inward, axis=1).clip(0.02)[:, None]


def turned(points):
    angle = 0.08
    turn = np.array([[1, 0, angle], [0, 1, 0], [-angle, 0, 1]])
    return points @ turn.T + np.array([0.006, 0.01, -0.006])


def jumped(points):
    """More at the held edge, nothing at the opposite one."""
    share = 1 - UV[:, 1:] / SIZE_M
    return points + share * (np.array([0.012, 0.008, 0.006]) + 0.06 * points * [1, 0, 0])


def smoothed(seen):
    weight = np.exp(-0.5 * ((TIMES - TIME_S) / 0.07) ** 2)
    return np.tensordot(weight / weight.sum(), seen, axes=1)


def row_by_row(seen):
    return at_times(seen, TIME_S - 0.08 * UV[:, 1] / SIZE_M)


# name: (what is drawn, points with the effect of the motion that is seen without it)
EFFECTS = {
    "added_mass": ("0.1 kg/m² of air carried along", of_material(added_mass=0.1)),
    "anisotropy": ("warp 4 times as stiff as weft, to stretch and to bend",
                   of_material(stretch_anisotropy=-0.7, bend_anisotropy=-0.7)),
    "bend_friction": ("moments of 6e-4 N", of_material(bend_friction=6e-4, bend_friction_curvature=10)),
    "bend_nonlinearity": ("twice as stiff to bend at 7 /m", of_material(bend_stiffening=2e-2)),
    "camera_delay": ("stamped 50 ms late", lambda seen: at_times(seen, TIME_S - 0.05)),
    "camera_distortion": ("k1 of a wide lens", lambda seen: distorted(seen[AT])),
    "coupling": ("narrows by 0.8 of what it stretches", of_material(coupling=0.8)),
    "creep": ("4 times the stiffness relaxes", of_material(creep=4)),
    "depth_bias": ("distances 6 % too long", lambda seen: CAMERA + 1.06 * (seen[AT] - CAMERA)),
    "draught": ("0.5 m/s from the front", lambda seen: motion(air_velocity_m_s=(0, 0.5, 0))[AT]),
    "dropped_frames": ("4 % of the frames lost so far: 40 ms", lambda seen: at_times(seen, 1.04 * TIME_S)),
    "grid_drift": ("nodes evenly between the edges", lambda seen: evenly_between_edges(seen[AT])),
    "grip_slip": ("15 % of the way of the right grip", lambda seen: motion(right_by=slipped())[AT]),
    "hem": ("60 times as stiff, 0.3 kg/m² more", of_material(hem_stiffness=60, hem_density=0.3)),
    "integrator_damping": ("steps of 20 ms", of_material(
        **{f"{k}_damping": KNIT[f"{k}_damping"] + 0.02 * KNIT[k] for k in ("stretch", "shear", "bend")})),
    "local_mass": ("a weight of 5 g", of_material(local_mass_kg=5e-3, local_u_m=0.2, local_v_m=0.24)),
    "marker_offset": ("fabric 15 mm inside and below the markers", lambda seen: motion(
        left_by=np.array([0.01, 0, -0.011]), right_by=np.array([-0.005, 0, -0.011]))[AT]),
    "mass_error": ("half as heavy again", of_material(density=1.5 * KNIT["density"])),
    "mesh_resolution": ("6 cells, not 24", lambda seen: motion(cells=6)[AT]),
    "nonlinear_drag": ("drag by speed alone, and by its square", of_material(drag_linear=0, drag_normal=3)),
    "outline_erosion": ("12 mm inside", lambda seen: eroded(seen[AT])),
    "outline_jitter": ("one frame", lambda seen: jumped(seen[AT])),
    "pose_error": ("0.08 rad and a centimetre", lambda seen: turned(seen[AT])),
    "projector_moved": ("what it lights, 19 mm off", lambda seen: seen[AT] + np.array([0.008, -0.012, -0.012])),
    "rest_curvature": ("15 /m: a radius of 67 mm", of_material(rest_curvature_u=15)),
    "rig_tilt": ("gravity turned by 0.12 rad", lambda seen: motion(gravity_m_s2=(0.6, 1.0, -9.74))[AT]),
    "rolling_shutter": ("80 ms from the first row to the last", row_by_row),
    "smoothing": ("over 70 ms (standard deviation)", smoothed),
    "stretch_friction": ("stresses of 2 N/m", of_material(stretch_friction=2.0)),
    "stretch_stiffening": ("twice as stiff at 1.7 % strain", of_material(stretch_stiffening=60)),
}
# What the grey swatch has otherwise, where the effect is not beside the usual one.
WITHOUT = {"mesh_resolution": lambda: motion(cells=24),
           "nonlinear_drag": lambda: motion({"drag_normal": 0, "drag_linear": 1.0})}


def lines_of(points, across, colour, width):
    """The grid as one path; across: the axis drawn to the right."""
    def place(p):
        return f"{(130 if across == 0 else 340) + 620 * p[across]:.0f},{28 - 620 * p[2]:.0f}"

    rows = grid(points)
    polylines = [*rows, *rows.transpose(1, 0, 2)]
    d = "".join("M" + "L".join(place(p) for p in line) for line in polylines)
    return f'<path d="{d}" fill="none" stroke="{colour}" stroke-width="{width}"/>'


def picture(name, drawn, without, with_it):
    parts = [lines_of(points, across, colour, width) for across in (0, 1)
             for points, colour, width in ((without, "#aaa", 1.2), (with_it, "#0b62a4", 1))]
    return "\n".join([
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 450 270" width="450" height="270" '
        f'font-family="sans-serif" font-size="11"><title>{name}</title><rect width="450" height="270" fill="#fff"/>',
        *parts,
        f'<text x="8" y="262" fill="#0b62a4">{drawn}</text><text x="200" y="10" fill="#666">from the front</text>',
        '<text x="360" y="10" fill="#666">from the right</text></svg>', ""])


def main(out):
    known = set(selvedge.effects())
    if known != set(EFFECTS):
        print(f"draw_effects.py: found pictures of {sorted(set(EFFECTS) - known)} that the library lacks, and none of "
              f"{sorted(known - set(EFFECTS))}", file=sys.stderr)
        return 1
    seen = motion()
    out.mkdir(parents=True, exist_ok=True)
    for name, (drawn, points) in EFFECTS.items():
        without = WITHOUT[name]()[AT] if name in WITHOUT else seen[AT]
        with_it = points(seen)
        (out / f"{name}.svg").write_text(picture(name, drawn, without, with_it), encoding="utf-8")
        print(f"{name}: {1e3 * np.sqrt(np.mean(np.sum((with_it - without) ** 2, axis=1))):.1f} mm")
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(pathlib.Path(sys.argv[1])))
