"""Fit and diagnosis, and their files as tables."""

import json
import pathlib
import tempfile
import unittest

import numpy
import selvedge
import swatch


def lengths(table):
    return {len(column) for column in table.values()}


class Results(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.scratch.cleanup)
        cls.folder = pathlib.Path(cls.scratch.name)
        cls.campaign = swatch.campaign(swatch.material(local_mass_kg=2e-3, local_u_m=0.2, local_v_m=0.25))
        selvedge.write_campaign(cls.campaign, cls.folder / "knit")
        cls.told = []
        cls.fit = selvedge.fit(
            cls.folder / "knit", cells=9, max_iterations=4, out=cls.folder / "fit",
            progress=lambda done, what: cls.told.append((done, what)),
        )
        cls.diagnosis = selvedge.diagnose(
            cls.campaign, fit=cls.fit, effects=["local_mass", "rig_tilt"], cells=9, progress=False
        )

    def test_a_fit_is_a_table(self):
        table = self.fit.parameters
        self.assertEqual(lengths(table), {len(self.fit.values)})
        self.assertEqual(dict(zip(table["name"], table["value"])), self.fit.values)
        self.assertTrue((table["low"] <= table["high"]).all())
        self.assertEqual(list(self.fit.trials["name"]), ["static-1", "waving-1", "waving-2"])
        errors = self.fit.trials
        moved = errors["name"] != "static-1"
        self.assertTrue((errors["error_end"][moved] < errors["error_start"][moved] + 0.5).all(), errors)

    def test_its_arrays_are_those_of_its_simulation(self):
        again = self.fit.simulation.residuals(self.fit.values, state=self.fit.state)
        for name, mm in self.fit.residuals_mm.items():
            seen = numpy.isfinite(mm)
            numpy.testing.assert_allclose(again[name][seen], mm[seen], atol=0.05)
        self.assertEqual(self.fit.material(self.campaign.trials[0]).bend, self.fit.values["bend"])

    def test_files_read_back(self):
        read = selvedge.read_fit(self.folder / "fit")
        self.assertEqual(read.values, self.fit.values)
        self.assertIsNone(read.simulation)
        for name, column in self.fit.parameters.items():
            numpy.testing.assert_array_equal(read.parameters[name], column)
        (self.folder / "diagnosis.json").write_text(json.dumps(self.diagnosis.json))
        self.assertEqual(selvedge.read_diagnosis(self.folder / "diagnosis.json").cause, self.diagnosis.cause)
        with self.assertRaisesRegex(selvedge.BadInput, "fit/1"):
            selvedge.read_fit(self.folder / "diagnosis.json")
        with self.assertRaises(selvedge.BadInput):
            selvedge.read_fit(self.folder / "nowhere")

    def test_a_diagnosis_is_tables(self):
        d = self.diagnosis
        self.assertAlmostEqual(sum(d.probability.values()), 1, places=6)
        self.assertIn(d.cause, d.probability)
        for table in (d.effects, d.sizes, d.budget, d.where):
            self.assertEqual(len(lengths(table)), 1)
        self.assertEqual(d.budget["effects"][-1], "unexplained")

    def test_progress_is_told(self):
        shares = [done for done, _ in self.told]
        self.assertTrue(shares and all(0 <= s <= 1 for s in shares))
        self.assertTrue(all(isinstance(what, str) for _, what in self.told))

    def test_what_is_written_names_its_recordings(self):
        with self.assertRaisesRegex(selvedge.BadInput, "write_campaign"):
            selvedge.fit(self.campaign, out=self.folder / "memory")
        with self.assertRaisesRegex(selvedge.BadInput, "read from a file"):
            selvedge.diagnose(self.campaign, fit=selvedge.read_fit(self.folder / "fit"))
        for wrong in ({"drag": "none at all"}, {"cells": 3}, {"hold_out": "mine"}):
            with self.subTest(wrong), self.assertRaises(ValueError):
                selvedge.fit(self.campaign, **wrong)
        with self.assertRaisesRegex(selvedge.BadInput, "magic"):
            selvedge.diagnose(self.campaign, effects=["magic"])


if __name__ == "__main__":
    unittest.main()
