"""Trials out of simulations: what a tracker would have recorded of a motion."""

import numpy

from selvedge import _core


def record(motion, *, name, fabric, left, right, uv, noise_m=2e-4, seed=1, experiment="waving"):
    """A Trial of a Motion, as a tracker sees dots on the fabric: in memory, see write_trial.

    fabric: a Fabric. left, right: (T, 3) m, the held corners at motion.time_s. uv: (N, 2) m, dots in the flat fabric.
    noise_m: one standard deviation of each coordinate, drawn with `seed`. experiment: static, waving or robot."""
    chance = numpy.random.default_rng(seed)

    def seen(points):
        points = numpy.asarray(points, dtype=float)
        return points + chance.normal(0, noise_m, points.shape)

    times, dots = len(motion.time_s), len(uv)
    step_s = numpy.median(numpy.diff(motion.time_s)) if times > 1 else 0
    return _core.Trial(
        name=name,
        experiment=experiment,
        fabric=fabric,
        starts_at_rest=True,
        mocap_rate_hz=1 / step_s if step_s > 0 else 0,
        mocap_noise_m=noise_m if noise_m > 0 else None,
        corners=_core.Corners(time_s=motion.time_s, left=seen(left), right=seen(right)),
        markers=_core.Markers(
            time_s=numpy.repeat(motion.time_s, dots),
            marker=numpy.tile(numpy.arange(dots), times),
            uv=numpy.tile(numpy.asarray(uv, dtype=float), (times, 1)),
            position=seen(motion.points(uv)).reshape(-1, 3),
        ),
    )
