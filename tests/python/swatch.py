"""A fabric and trials of it that the module itself simulates, small enough for tests."""

import numpy
import selvedge

FABRIC = selvedge.Fabric(name="test knit", width_m=0.3, height_m=0.3, mass_kg=0.16 * 0.09)
TRUE = {"stretch": 90.0, "shear": 45.0, "bend": 8e-5, "drag_normal": 1.3}
DOTS = numpy.array([(0.03 + 0.06 * i, 0.03 + 0.06 * j) for j in range(5) for i in range(5)])


def path(amplitude_m, seconds, frequency_hz=1.5):
    """Times and corners: the right one goes forth and back."""
    time_s = numpy.arange(int(round(seconds * 120)) + 1) / 120
    swing = numpy.where(time_s < 0.1, 0, 0.5 * (1 - numpy.cos(2 * numpy.pi * frequency_hz * (time_s - 0.1))))
    left = numpy.tile([-0.12, 0.0, 0.0], (len(time_s), 1))
    right = numpy.array([0.12, 0.0, 0.0]) + amplitude_m * swing[:, None] * numpy.array([0.0, 1.0, 0.3])
    return time_s, left, right


def material(**more):
    return selvedge.Material(density=0.16, **{**TRUE, **more})


def swing(amplitude_m=0.09, seconds=0.6, of=None, **more):
    time_s, left, right = path(amplitude_m, seconds)
    return selvedge.simulate(
        of or material(), width_m=0.3, height_m=0.3, time_s=time_s, left=left, right=right, cells=9, progress=False,
        **more,
    )


def trial(name, amplitude_m, seconds, seed, of=None):
    _, left, right = path(amplitude_m, seconds)
    return selvedge.record(
        swing(amplitude_m, seconds, of), name=name, fabric=FABRIC, left=left, right=right, uv=DOTS, seed=seed,
        experiment="waving" if amplitude_m > 0 else "static",
    )


def campaign(of=None):
    return selvedge.Campaign(
        fabric="test knit",
        trials=[
            trial("static-1", 0, 0.1, 1, of),
            trial("waving-1", 0.09, 0.8, 2, of),
            trial("waving-2", 0.06, 0.8, 3, of),
        ],
    )
