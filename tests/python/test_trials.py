"""Trials and campaigns to and from disk, and what is refused."""

import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy
import selvedge
import swatch


class Trials(unittest.TestCase):
    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.scratch.name)
        self.addCleanup(self.scratch.cleanup)

    def test_a_campaign_is_read_as_it_was_written(self):
        made = swatch.campaign()
        made.replicates = [["waving-1", "waving-2"]]
        selvedge.write_campaign(made, self.folder / "knit")
        read = selvedge.read_campaign(self.folder / "knit")
        self.assertEqual([t.name for t in read.trials], ["static-1", "waving-1", "waving-2"])
        self.assertEqual(read.replicates, made.replicates)
        for a, b in zip(made.trials, read.trials):
            self.assertEqual((a.experiment, a.fabric.mass_kg), (b.experiment, b.fabric.mass_kg))
            for part, names in [("corners", "time_s left right"), ("markers", "time_s marker uv position")]:
                for name in names.split():
                    numpy.testing.assert_array_equal(
                        getattr(getattr(a, part), name), getattr(getattr(b, part), name), f"{part}.{name}"
                    )

    def test_a_scanned_surface_is_kept(self):
        made = swatch.trial("scanned", 0, 0.1, 1)
        points = numpy.arange(60.0).reshape(20, 3) / 100
        made.surface = selvedge.Surface(time_s=[0.0] * 12 + [0.05] * 8, position=points, seen_from_m=[0.1, -1, 0.2])
        made.markers = None
        selvedge.write_trial(made, self.folder / "scanned")
        read = selvedge.read_trial(self.folder / "scanned")
        self.assertIsNone(read.markers)
        numpy.testing.assert_array_equal(read.surface.position, points)
        numpy.testing.assert_array_equal(read.surface.time_s, made.surface.time_s)
        numpy.testing.assert_array_equal(read.surface.seen_from_m, [0.1, -1, 0.2])
        made.surface.time_s = [0.0]
        with self.assertRaisesRegex(selvedge.BadInput, "surface: found an array of 20 rows, expected 1"):
            selvedge.write_trial(made, self.folder / "spoilt")

    def test_pictures_are_kept(self):
        made = swatch.trial("seen", 0, 0.1, 1)
        made.camera = selvedge.Projection(
            matrix=[[500, 80, 0, 80], [0, 60, -500, 60], [0, 1, 0, 1]], width_px=160, height_px=120
        )
        made.projector = made.camera
        made.pattern = selvedge.StripePattern(period_px=8, duty=0.5)
        made.frame_rate_hz = 30
        made.frames = selvedge.Frames(number=[0, 1], time_s=[0.0, 1 / 30])
        images = [numpy.full((120, 160), grey, dtype=numpy.uint8) for grey in (10, 200)]
        selvedge.write_trial(made, self.folder / "seen", images)
        read = selvedge.read_trial(self.folder / "seen")
        for i, image in enumerate(images):
            numpy.testing.assert_array_equal(read.read_frame(i), image)
        selvedge.write_trial(read, self.folder / "again")
        numpy.testing.assert_array_equal(selvedge.read_trial(self.folder / "again").read_frame(1), images[1])
        with self.assertRaises(IndexError):
            read.read_frame(2)

    def test_an_error_is_the_one_that_the_command_line_prints(self):
        selvedge.write_trial(swatch.trial("knit", 0, 0.1, 1), self.folder / "knit")
        table = self.folder / "knit" / "corners.csv"
        table.write_text(table.read_text().replace("0,-0.", "0,x.", 1))
        with self.assertRaises(selvedge.BadInput) as caught:
            selvedge.read_trial(self.folder / "knit")
        self.assertIsInstance(caught.exception, ValueError)
        self.assertEqual(type(caught.exception).__module__, "selvedge")
        said = subprocess.run(
            [os.environ["SELVEDGE_PROGRAM"], "check", str(self.folder / "knit")], capture_output=True, text=True
        )
        self.assertEqual(said.returncode, 2)
        self.assertIn(str(caught.exception), said.stderr + said.stdout)
        self.assertNotIn("\n", str(caught.exception))

    def test_what_does_not_fit_together_is_refused_and_leaves_nothing(self):
        wrong = {
            "corners": lambda t: setattr(t.corners, "left", numpy.zeros((3, 3))),
            "markers": lambda t: setattr(t.markers, "marker", [1]),
            "mass_kg": lambda t: setattr(t.fabric, "mass_kg", -1),
            "time_s": lambda t: setattr(t.corners, "time_s", t.corners.time_s[::-1]),
            "starts_at_rest": lambda t: setattr(t, "experiment", "dancing"),
        }
        for name, spoil in wrong.items():
            with self.subTest(name):
                made = swatch.trial("knit", 0, 0.1, 1)
                with self.assertRaises(selvedge.BadInput):
                    spoil(made)
                    selvedge.write_trial(made, self.folder / "knit")
                self.assertFalse((self.folder / "knit").exists())

    def test_a_folder_that_is_there_is_not_written_over(self):
        (self.folder / "knit").mkdir()
        with self.assertRaisesRegex(selvedge.BadInput, "already"):
            selvedge.write_trial(swatch.trial("knit", 0, 0.1, 1), self.folder / "knit")
        self.assertTrue((self.folder / "knit").is_dir())

    def test_arrays_are_read_only_and_parts_are_the_owners(self):
        made = swatch.trial("knit", 0, 0.1, 1)
        with self.assertRaises(ValueError):
            made.corners.left[0, 0] = 1
        made.corners.left = made.corners.left + 1
        made.markers.position = made.markers.position + 1
        self.assertAlmostEqual(made.corners.left[0, 1], 1, delta=0.01)
        self.assertGreater(made.markers.position[:, 1].mean(), 0.5)
        campaign = selvedge.Campaign(fabric="knit", trials=[made])
        campaign.trials[0].name = "renamed"
        self.assertEqual(campaign.trials[0].name, "renamed")


if __name__ == "__main__":
    unittest.main()
