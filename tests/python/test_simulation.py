"""The spline sheet, residuals and derivatives."""

import threading
import time
import unittest

import numpy
import selvedge
import swatch


class Sheets(unittest.TestCase):
    def test_held_corners_follow_their_path_and_the_rest_hangs(self):
        time_s, left, right = swatch.path(0.09, 0.6)
        motion = swatch.swing()
        self.assertTrue(motion.at_rest and motion.finite)
        corners = motion.points([[0, 0], [0.3, 0]])
        # The rig grips a square of 7.5 mm, whose corner gives way by a fraction of a millimetre.
        numpy.testing.assert_allclose(corners[:, 0], left, atol=5e-4)
        numpy.testing.assert_allclose(corners[:, 1], right, atol=5e-4)
        self.assertEqual(motion.position.shape, (len(time_s), len(motion.rest_uv), 3))
        self.assertEqual(motion.triangles.shape[1], 3)
        self.assertLess(motion.position[0, :, 2].mean(), -0.1)
        # Vertices are points of the fabric.
        numpy.testing.assert_allclose(motion.points(motion.rest_uv), motion.position, atol=1e-9)

    def test_fabrics_side_by_side_move_as_they_do_alone(self):
        fabrics = [swatch.material(), swatch.material(bend=4e-4), swatch.material(drag_normal=5)]
        together = swatch.swing(of=fabrics)
        self.assertEqual(len(together), 3)
        # Lanes share the shortest step, so that this is close and not equal.
        for fabric, motion in zip(fabrics, together):
            numpy.testing.assert_allclose(swatch.swing(of=fabric).position[-1], motion.position[-1], atol=2e-3)
        self.assertGreater(numpy.abs(together[0].position[-1] - together[1].position[-1]).max(), 2e-3)

    def test_what_cannot_be_simulated_is_refused(self):
        for name, wrong in {
            "width_m": {"width_m": 0},
            "left, right": {"left": numpy.zeros((3, 3))},
            "held": {"held": "by hand"},
            "cells": {"cells": 1000},
            "material": {"material": swatch.material(bend=-1)},
        }.items():
            time_s, left, right = swatch.path(0.05, 0.1)
            given = dict(material=swatch.material(), width_m=0.3, height_m=0.3, time_s=time_s, left=left, right=right)
            with self.subTest(name), self.assertRaisesRegex(selvedge.BadInput, name):
                selvedge.simulate(**{**given, **wrong}, progress=False)

    def test_other_threads_run_meanwhile(self):
        turns, over = [0], threading.Event()

        def count():
            while not over.is_set():
                turns[0] += 1
                time.sleep(0.001)

        other = threading.Thread(target=count)
        other.start()
        begin = time.monotonic()
        before = turns[0]
        swatch.swing(seconds=2)
        took, during = time.monotonic() - begin, turns[0] - before
        over.set()
        other.join()
        self.assertGreater(during, 2, f"the other thread took {during} turns in {took:.2f} s")


class Residuals(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.campaign = swatch.campaign()
        cls.simulation = selvedge.Simulation(cls.campaign, cells=9)

    def test_the_truth_leaves_noise_and_other_values_more(self):
        truth = self.simulation.rms_mm(swatch.TRUE)
        wrong = self.simulation.rms_mm({**swatch.TRUE, "bend": 4e-4, "drag_normal": 4})
        self.assertEqual(list(truth), ["static-1", "waving-1", "waving-2"])
        for name in truth:
            self.assertLess(truth[name], 1.0)
        self.assertGreater(wrong["waving-1"], 2 * truth["waving-1"])

    def test_derivatives_are_those_of_the_residuals(self):
        usual = {**self.simulation.usual, **swatch.TRUE}
        state = self.simulation.state(usual)
        names = [p.name for p in self.simulation.parameters]
        slopes = self.simulation.derivatives(usual, state=state)["waving-1"]
        step = 0.05
        moved = [
            self.simulation.residuals({**usual, "drag_normal": usual["drag_normal"] * numpy.exp(s)}, state=state)
            for s in (step, -step)
        ]
        by_hand = (moved[0]["waving-1"] - moved[1]["waving-1"]) / (2 * step)
        self.assertEqual(slopes.shape, (len(by_hand), len(names)))
        column = slopes[:, names.index("drag_normal")]
        seen = numpy.isfinite(by_hand)
        self.assertLess(
            numpy.linalg.norm(column[seen] - by_hand[seen]), 0.05 * numpy.linalg.norm(by_hand[seen])
        )

    def test_residuals_are_simulated_less_seen(self):
        state = self.simulation.state(swatch.TRUE)
        residual = self.simulation.residuals(swatch.TRUE, state=state)["static-1"].reshape(25, -1, 3)
        motion = self.simulation.motion("static-1", swatch.TRUE, state=state)
        markers = self.campaign.trials[0].markers
        seen = markers.position[markers.marker == 7].mean(axis=0)
        there = motion.points(swatch.DOTS)[0, 7]
        numpy.testing.assert_allclose(residual[7, 0], 1e3 * (there - seen), atol=0.5)
        self.assertEqual(self.simulation.time_s()["static-1"].shape, residual.reshape(-1).shape)
        self.assertTrue((self.simulation.sd_mm()["static-1"] > 0).all())

    def test_values_are_looked_at(self):
        for wrong in ({"strech": 1}, {"bend": -1}, [1, 2], {"bend": float("nan")}):
            with self.subTest(wrong), self.assertRaises(selvedge.BadInput):
                self.simulation.residuals(wrong)
        ordered = [self.simulation.usual[p.name] for p in self.simulation.parameters]
        self.assertEqual(self.simulation.rms_mm(ordered), self.simulation.rms_mm({}))


if __name__ == "__main__":
    unittest.main()
