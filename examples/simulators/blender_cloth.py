"""Blender's cloth as a simulator that speaks simulator/1 (docs/simulator.md). Debian: blender (3.4).

    python3 blender_cloth.py [--cells 16] [--quality 2]

starts Blender headless on this same file. Blender writes to its standard output as it likes, so that becomes its
standard error, and answers go out by a copy of the one that was there. Blender's unit of time is a frame, in which
gravity is a thousandth of that in m/s2: stiffness, damping and mass of a vertex are those of its panels, in its units.
No self-collision.
"""
import argparse
import json
import os
import shutil
import sys

FPS, HANG_S = 240, 3.0  # frames a second; for so long it is left to hang, well damped
FIRST = round(HANG_S * FPS) + 1  # the frame in which the trial starts
SECOND = 1000 ** 0.5  # in Blender's unit of time
PARAMETERS = [  # of bpy.types.ClothSettings; name, default, lower, upper, as its logarithm
    ("tension_stiffness", 1e-3, 1e-4, 1e-2, True),
    ("compression_stiffness", 1e-3, 1e-5, 1e-2, True),
    ("shear_stiffness", 3e-4, 1e-5, 1e-2, True),
    ("bending_stiffness", 5e-3, 1e-4, 0.5, True),
    ("tension_damping", 1e-5, 0, 1e-3, False),  # of compression and shear too
    ("air_damping", 1e-4, 1e-6, 1e-2, True),
]


def options(arguments):
    parser = argparse.ArgumentParser(prog="blender_cloth.py")
    parser.add_argument("--cells", type=int, default=16, help="quads along a side")
    parser.add_argument("--quality", type=int, default=2, help="steps a frame, of which a second has 240")
    parser.add_argument("--answers", type=int, help=argparse.SUPPRESS)  # the file that they go to
    return parser.parse_args(arguments)


def start_blender():
    options(sys.argv[1:])  # what is wrong is said before Blender starts
    blender = shutil.which("blender")
    if not blender:
        sys.exit("blender_cloth.py: found no blender, expected Debian's package of that name")
    answers = os.dup(1)
    os.set_inheritable(answers, True)
    os.dup2(2, 1)
    # It would look for its modules beside the first python3 of PATH, which need not be the one it was built for.
    os.execve(blender, [blender, "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                        os.path.abspath(__file__), "--", *sys.argv[1:], "--answers", str(answers)],
              {**os.environ, "PATH": os.defpath})


class Sheet:
    """The swatch as a mesh of quads under the cloth modifier, its held points moved by shape keys."""

    def __init__(self, trial, cells, quality, parameters):
        self.trial, self.count = trial, cells + 1
        self.column, self.row = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1))
        self.column, self.row = self.column.ravel(), self.row.ravel()
        held = self.row == 0
        if trial["hold"] == "corners":
            held &= (self.column == 0) | (self.column == 1)
        self.held = np.flatnonzero(held)
        self.make_object(cells)
        self.make_cloth(quality, parameters)
        self.move_grips()
        self.hang_before(parameters["air_damping"])

    def grips(self, times):  # linear between the recorded times, at rest outside; times × 6
        return np.stack([np.interp(times, self.trial["grip_times"], axis)
                         for side in ("left", "right") for axis in zip(*self.trial[side])], axis=1)

    def make_object(self, cells):
        n, trial = self.count, self.trial
        flat = np.stack([self.column * trial["width"], 0 * self.row, -self.row * trial["height"]], axis=1)
        quads = [(k, k + 1, k + n + 1, k + n) for k in range(n * n - n) if k % n < cells]
        mesh = bpy.data.meshes.new("fabric")
        mesh.from_pydata(flat.tolist(), [], quads)
        self.object = bpy.data.objects.new("fabric", mesh)
        bpy.context.scene.collection.objects.link(self.object)
        self.object.vertex_groups.new(name="held").add(self.held.tolist(), 1, "REPLACE")
        self.object.shape_key_add(name="basis")
        self.rest = self.object.shape_key_add(name="flat")  # the first key cannot be a rest shape
        # It begins between its grips, with a bulge so that it buckles to one side.
        down = np.array(trial["gravity"]) / np.linalg.norm(trial["gravity"])
        grip = self.grips([trial["start"]])[0]
        begin = np.outer(1 - self.column, grip[:3]) + np.outer(self.column, grip[3:])
        begin += np.outer(self.row * trial["height"], down)
        begin[n:, 1] += 0.02 * np.sin(3.5 * self.column[n:])
        self.key("begin", begin - flat).value = 1
        for k in range(6):
            moved = np.zeros_like(flat)
            moved[self.held, k % 3] = (1 - self.column if k < 3 else self.column)[self.held]
            self.key(f"grip{k}", moved)

    def key(self, name, offset):
        key = self.object.shape_key_add(name=name)
        at = np.empty(3 * len(offset))
        self.rest.data.foreach_get("co", at)
        key.data.foreach_set("co", at + offset.ravel())
        key.slider_min, key.slider_max = -10, 10
        return key

    def make_cloth(self, quality, parameters):
        modifier = self.object.modifiers.new("cloth", "CLOTH")
        modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, 100000
        modifier.collision_settings.use_collision = False
        cloth = self.cloth = modifier.settings
        cloth.quality, cloth.time_scale = quality, SECOND / FPS  # with another step it hangs elsewhere, by millimetres
        cloth.bending_model, cloth.rest_shape_key = "ANGULAR", self.rest
        cloth.vertex_group_mass, cloth.pin_stiffness = "held", 1
        cloth.mass = self.trial["mass"] / self.count ** 2
        cloth.tension_stiffness = parameters["tension_stiffness"]
        cloth.compression_stiffness = parameters["compression_stiffness"]
        cloth.shear_stiffness = parameters["shear_stiffness"]
        cloth.bending_stiffness = parameters["bending_stiffness"]
        cloth.tension_damping = cloth.compression_damping = cloth.shear_damping = parameters["tension_damping"]
        cloth.bending_damping = 0

    @staticmethod
    def curve(of, path, frames, values, interpolation):
        data = of.animation_data or of.animation_data_create()
        data.action = data.action or bpy.data.actions.new("fabric")
        curve = data.action.fcurves.new(path)
        curve.keyframe_points.add(len(frames))
        curve.keyframe_points.foreach_set("co", np.stack([frames, values], axis=1).ravel())
        for point in curve.keyframe_points:
            point.interpolation = interpolation
        curve.update()

    def move_grips(self):
        self.count_of_frames = int(np.ceil((self.trial["times"][-1] - self.trial["start"]) * FPS - 1e-6)) + 2
        frames = np.arange(self.count_of_frames)
        grips = self.grips(self.trial["start"] + frames / FPS)
        for k in range(6):
            self.curve(self.object.data.shape_keys, f'key_blocks["grip{k}"].value', FIRST + frames,
                       grips[:, k] - grips[0, k], "LINEAR")

    def hang_before(self, air_damping):
        hang = 6 * self.cloth.mass / (0.01 * SECOND)  # 6 a second
        self.curve(self.object, 'modifiers["cloth"].settings.air_damping', [1, FIRST], [hang, air_damping], "CONSTANT")

    def shapes(self):  # of each frame from the start on
        out, scene = [], bpy.context.scene
        scene.gravity = self.trial["gravity"]
        for frame in range(1, FIRST + self.count_of_frames):
            scene.frame_set(frame)
            if frame >= FIRST:
                at = np.empty(3 * self.count ** 2)
                evaluated = self.object.evaluated_get(bpy.context.evaluated_depsgraph_get())
                evaluated.data.vertices.foreach_get("co", at)
                out.append(at.reshape(-1, 3))
        return np.array(out)

    def positions(self):
        shapes, cells = self.shapes(), self.count - 1
        at = np.array(self.trial["points"]) / (self.trial["width"], self.trial["height"]) * cells
        hat = lambda k, of: np.maximum(0, 1 - abs(at[:, k:k + 1] - cells * of))
        weights = hat(0, self.column) * hat(1, self.row)  # of the four vertices about each point
        frame = (np.array(self.trial["times"]) - self.trial["start"]) * FPS
        before = np.minimum(frame.astype(int), len(shapes) - 2)
        share = (frame - before)[:, None, None]
        return weights @ ((1 - share) * shapes[before] + share * shapes[before + 1])

    def remove(self):
        bpy.data.batch_remove([self.object, self.object.data, *bpy.data.actions])


def serve(chosen):
    out = os.fdopen(chosen.answers, "wb")

    def say(head, numbers=b""):
        out.write(json.dumps(head).encode() + b"\n" + numbers)
        out.flush()

    say({"protocol": "simulator/1", "name": "Blender's cloth", "version": bpy.app.version_string,
         "holds": ["corners", "top_edge"],
         "parameters": [{"name": name, "unit": "", "default": usual, "lower": lower, "upper": upper, "log": log}
                        for name, usual, lower, upper, log in PARAMETERS]})
    trials = {}
    for told in map(json.loads, sys.stdin):
        if told["do"] == "trial":
            trials[told["trial"]] = told
            continue
        sheet = Sheet(trials[told["trial"]], chosen.cells, chosen.quality, told["parameters"])
        answer = sheet.positions().astype("<f4")
        sheet.remove()
        if np.isfinite(answer).all():
            say({"run": told["run"], "floats": answer.size}, answer.tobytes())
        else:
            say({"run": told["run"], "error": "diverged"})


try:
    import bpy
except ImportError:
    start_blender()
import numpy as np

serve(options(sys.argv[sys.argv.index("--") + 1:]))
