"""A sheet of masses and springs that speaks simulator/1 (docs/simulator.md); the standard library is enough."""
import bisect, json, math, sys
CELLS, N, STEP, HANG = 5, 6, 1e-3, 3.0  # cells and masses along a side; s; s to hang at first, well damped
mix = lambda a, b, share: [p + share * (q - p) for p, q in zip(a, b)]

def simulate(trial, stretch, shear, drag):
    w, h, gravity, start = (trial[key] for key in ("width", "height", "gravity", "start"))
    du, dv, mass, loss = w / CELLS, h / CELLS, trial["mass"] / N**2, drag * w * h / trial["mass"]
    times, left, right = trial["grip_times"] + [math.inf], *(trial[k] + trial[k][-1:] for k in ("left", "right"))
    def between(t, share):  # the grips, which go linearly between the times and rest outside
        k = bisect.bisect(times, t, 1)
        s = max(0, (t - times[k - 1]) / (times[k] - times[k - 1]))
        return mix(mix(left[k - 1], left[k], s), mix(right[k - 1], right[k], s), share)
    springs = [(i, i + c + N * r, k, math.hypot(c * du, r * dv)) for i in range(N * N)
               for c, r, k in ((1, 0, stretch), (0, 1, stretch), (1, 1, shear), (-1, 1, shear))
               if 0 <= i % N + c < N and i // N + r < N]
    x = [[p + i // N * dv * g / 9.81 for p, g in zip(between(start, i % N / CELLS), gravity)] for i in range(N * N)]
    for i in range(N, N * N): x[i][1] += 0.02 * math.sin(3.5 * (i % N) / CELLS)  # it buckles to this side
    speed, t, answer = [[0.0] * 3 for _ in x], start - HANG, []
    for when in trial["times"]:
        while t < when - STEP / 2:
            keep, t, force = math.exp(-STEP * (loss if t >= start else 6)), t + STEP, [[0.0] * 3 for _ in x]
            for i, j, k, rest in springs:
                pull = k * (1 - rest / math.dist(x[i], x[j]))
                for c in range(3): force[i][c] += pull * (x[j][c] - x[i][c]); force[j][c] -= pull * (x[j][c] - x[i][c])
            speed = [[keep * (v + STEP * (f / mass + g)) for v, f, g in zip(*at, gravity)] for at in zip(speed, force)]
            x = [[p + STEP * v for p, v in zip(*at)] for at in zip(x, speed)]
            for i in (0, CELLS) if trial["hold"] == "corners" else range(N): x[i] = between(t, i / CELLS)
        for a, b in ((u / du, v / dv) for u, v in trial["points"]):  # between four masses
            k = min(int(a), CELLS - 1) + N * min(int(b), CELLS - 1)
            answer += mix(mix(x[k], x[k + 1], a - k % N), mix(x[k + N], x[k + N + 1], a - k % N), b - k // N)
    return {"positions": answer} if all(map(math.isfinite, answer)) else {"error": "diverged"}

parameters = [dict(name=name, unit=unit, default=default, lower=lower, upper=upper, log=True) for name, unit, default,
    lower, upper in (("stretch", "N/m", 20, 2, 60), ("shear", "N/m", 5, 0.5, 30), ("drag", "kg/(m2 s)", 0.5, 0.01, 10))]
hello, trials = dict(protocol="simulator/1", name="masses and springs", holds=["corners", "top_edge"]), {}
print(json.dumps(dict(hello, parameters=parameters)), flush=True)
for told in map(json.loads, sys.stdin):
    if told["do"] == "trial": trials[told["trial"]] = told
    else: print(json.dumps({"run": told["run"], **simulate(trials[told["trial"]], **told["parameters"])}), flush=True)
