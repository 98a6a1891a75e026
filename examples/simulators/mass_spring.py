#!/usr/bin/env python3
"""A sheet of masses and springs that speaks simulator/1 (docs/simulator.md); the standard library is enough."""
import json, math, sys
N, STEP, REST = 6, 1e-3, 3.0  # masses along a side; s; s for which it is left to hang, well damped

def mix(a, b, share):
    return [p + share * (q - p) for p, q in zip(a, b)]

def grips(trial, t):  # linear between the times, at rest outside
    times, left, right = trial["grip_times"], trial["left"], trial["right"]
    k = next((k for k in range(1, len(times)) if times[k] > t), len(times) - 1)
    share = min(max((t - times[k - 1]) / (times[k] - times[k - 1]), 0), 1) if k > 0 else 0
    return mix(left[k - 1], left[k], share), mix(right[k - 1], right[k], share)

def simulate(trial, stretch, shear, drag):
    width, height, gravity, start = (trial[key] for key in ("width", "height", "gravity", "start"))
    mass, area, g = trial["mass"] / N**2, width * height / N**2, math.hypot(*gravity)
    flat = [(width * (i % N) / (N - 1), height * (i // N) / (N - 1)) for i in range(N * N)]
    near = [(1, 0, stretch), (0, 1, stretch), (1, 1, shear), (-1, 1, shear)]
    springs = [(i, i + c + N * r, k, math.dist(flat[i], flat[i + c + N * r])) for i in range(N * N)
               for c, r, k in near if 0 <= i % N + c < N and i // N + r < N]
    held = {i: i / (N - 1) for i in ((0, N - 1) if trial["hold"] == "corners" else range(N))}
    x = [[p + v / g * a for p, a in zip(mix(*grips(trial, start), u / width), gravity)] for u, v in flat]
    for i in range(N, N * N): x[i][1] += 0.02 * math.sin(3.5 * (i % N) / (N - 1))  # it buckles to this side
    speed, t, answer = [[0.0] * 3 for _ in x], start - REST, []
    for when in trial["times"]:
        while t < when - STEP / 2:
            force = [[mass * a for a in gravity] for _ in x]
            for i, j, k, rest in springs:
                apart = [q - p for p, q in zip(x[i], x[j])]
                pull = k * (1 - rest / math.hypot(*apart))
                for c in range(3): force[i][c] += pull * apart[c]; force[j][c] -= pull * apart[c]
            t, keep = t + STEP, math.exp(-STEP * (drag * area / mass if t > start else 6))
            speed = [[keep * (v + STEP / mass * f) for v, f in zip(*both)] for both in zip(speed, force)]
            x = [[p + STEP * v for p, v in zip(*both)] for both in zip(x, speed)]
            for i, share in held.items(): x[i] = mix(*grips(trial, t), share)
        if not all(abs(c) < 1e3 for p in x for c in p): raise ValueError(f"diverged at {t:.3f} s")
        for u, v in trial["points"]:  # between four masses
            c, r = min(int(u / width * (N - 1)), N - 2), min(int(v / height * (N - 1)), N - 2)
            a, b = u / width * (N - 1) - c, v / height * (N - 1) - r
            k = r * N + c
            answer.append(mix(mix(x[k], x[k + 1], a), mix(x[k + N], x[k + N + 1], a), b))
    return answer

def parameter(name, unit, default, lower, upper, **more):
    return dict(name=name, unit=unit, default=default, lower=lower, upper=upper, log=True, **more)

print(json.dumps(dict(protocol="simulator/1", name="masses and springs", holds=["corners", "top_edge"], parameters=[
    parameter("stretch", "N/m", 20, 2, 60), parameter("shear", "N/m", 5, 0.5, 30),
    parameter("drag", "kg/(m2 s)", 0.5, 0.01, 10, motion_only=True)])), flush=True)
trials = {}
for told in map(json.loads, sys.stdin):
    if told["do"] == "trial": trials[told["trial"]] = told
    else:
        try: answer = dict(positions=simulate(trials[told["trial"]], **told["parameters"]))
        except (ArithmeticError, ValueError) as error: answer = dict(error=str(error))
        print(json.dumps(dict(run=told["run"], **answer)), flush=True)
