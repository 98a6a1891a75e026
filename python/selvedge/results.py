"""Fits and diagnoses: made, or read from fit.json and diagnosis.json (docs/formats.md), as tables of numpy arrays."""

import json
import pathlib

import numpy

from selvedge import _core


def _number(value):
    return numpy.nan if value is None else value


def _table(rows, columns):
    """Rows as dicts into a dict of columns; what a row lacks is NaN, or empty in a column of words."""
    table = {}
    for name in columns:
        column = [row.get(name) for row in rows]
        words = any(isinstance(value, str) for value in column)
        table[name] = numpy.array([("" if words else numpy.nan) if v is None else v for v in column])
    return table


def _interval(entry, key="interval"):
    low, high = entry.get(key) or (None, None)
    return {"low": _number(low), "high": _number(high)}


class _Result:
    """What a JSON file of one of the formats says: `json`, all of it, and tables."""

    def __init__(self, values):
        self.json = values

    @classmethod
    def _read(cls, path, name, form):
        path = pathlib.Path(path)
        path = path / name if path.is_dir() else path
        try:
            values = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise _core.BadInput(f"{path}: found no {form}: {error}") from error
        found = values.get("format") if isinstance(values, dict) else None
        if found != form:
            raise _core.BadInput(f'{path}: format: found {found!r}, expected "{form}"')
        return cls(values)


class Fit(_Result):
    """A fit of a campaign.

    values: {name: value} of the parameters. held_out_mm: root mean square error of what was not fitted, mm.
    simulation, state, residuals_mm: of a fit that was made here, else None: the Simulation on its last grid, the State
    in which it ended, {trial: (R,) mm}."""

    def __init__(self, values, fitted=None):
        super().__init__(values)
        self._fitted = fitted
        self.values = {name: p["value"] for name, p in values["parameters"].items()}
        self.held_out_mm = _number(values.get("held_out", {}).get("error"))
        self.remarks = list(values.get("remarks", []))
        self.simulation = fitted.simulation if fitted else None
        self.state = fitted.state if fitted else None
        self.residuals_mm = fitted.residuals_mm if fitted else None

    @property
    def parameters(self):
        """Columns name, value, unit, low, high (90 %), variability_percent, at_bound, determined."""
        rows = [{"name": n, **p, **_interval(p)} for n, p in self.json["parameters"].items()]
        return _table(
            rows, ["name", "value", "unit", "low", "high", "variability_percent", "at_bound", "determined"]
        )

    @property
    def trials(self):
        """Columns name, error_start, error_end, error_held_out (root mean square, mm), frames."""
        rows = [{"name": n, **t} for n, t in self.json["trials"].items()]
        return _table(rows, ["name", "error_start", "error_end", "error_held_out", "frames"])

    def material(self, trial):
        """The fitted Material, with the density of a trial's fabric."""
        swatch = trial.fabric
        return _core.Material(density=swatch.mass_kg / (swatch.width_m * swatch.height_m), **self.values)

    def __repr__(self):
        return f"<selvedge.Fit of {self.json['campaign']}: held-out error {self.held_out_mm:.2f} mm>"


class Diagnosis(_Result):
    """Where the fitted simulation still differs from the recording, and what explains it.

    cause: an effect, "none" or "unknown". probability: {cause: its probability}. gap_mm: beyond the sensor's noise,
    root mean square, mm; gap_interval_mm: (low, high), 90 %; None both where one group of trials alone cannot tell."""

    def __init__(self, values):
        super().__init__(values)
        self.cause, self.side = values["cause"], values["side"]
        self.probability = dict(values["probabilities"])
        self.gap_mm = values["gap"]["value_mm"]
        self.gap_interval_mm = tuple(values["gap"]["interval_mm"])
        self.next_experiment = values["next_experiment"]["do"]
        self.remarks = list(values.get("remarks", []))

    @property
    def effects(self):
        """Columns name, side, probability (that it is there), before_mm, after_mm, fraction, low, high: error of what
        was not fitted without and with it, and the share of the gap that it closes (90 %)."""
        rows = []
        for name, shrink in self.json["shrink"].items():
            rows.append(
                {
                    "name": name,
                    "side": self.json.get("sides", {}).get(name),
                    "probability": self.json.get("inclusion", {}).get(name),
                    "before_mm": shrink.get("held_out_before_mm"),
                    "after_mm": shrink.get("held_out_after_mm"),
                    "fraction": shrink.get("fraction"),
                    **_interval(shrink),
                }
            )
        rows.sort(key=lambda row: -(row["probability"] or 0))
        return _table(rows, ["name", "side", "probability", "before_mm", "after_mm", "fraction", "low", "high"])

    @property
    def sizes(self):
        """Columns effect, parameter, value, unit, low, high (90 %)."""
        rows = [
            {"effect": effect, "parameter": parameter, **size, **_interval(size)}
            for effect, sizes in self.json["effect_size"].items()
            for parameter, size in sizes.items()
        ]
        return _table(rows, ["effect", "parameter", "value", "unit", "low", "high"])

    @property
    def budget(self):
        """Columns effects, share, low, high (90 %) of the gap; the last row is what nothing explains."""
        budget = self.json["budget"]
        rows = [{"effects": "+".join(p["effects"]), "share": p["share"], **_interval(p)} for p in budget["parts"]]
        rows.append({"effects": "unexplained", **budget["unexplained"], **_interval(budget["unexplained"])})
        return _table(rows, ["effects", "share", "low", "high"])

    @property
    def where(self):
        """Columns axis, cell, share, mm, p_value: how what is left splits by region, time, frequency, regime, row."""
        return _table(self.json["where"], ["axis", "cell", "share", "mm", "p_value"])

    def __repr__(self):
        return f"<selvedge.Diagnosis of {self.json['campaign']}: {self.cause}, {self.probability[self.cause]:.2f}>"


def fit(
    campaign,
    *,
    drag="nonlinear_drag",
    cells=0,
    hold_out="automatic",
    max_iterations=10,
    out=None,
    progress=None,
):
    """Fits a campaign (docs/fit.md): a Campaign, or a folder. Returns a Fit.

    drag: nonlinear_drag, linear_drag or no_drag. cells: of the sheet along the width (6 to 64); 0: as many as the
    fabric asks for. hold_out: automatic, frames, trials or none. out: a folder for fit.json and report.html, where
    campaign is a folder."""
    fitted = _core._fit(campaign, drag, cells, hold_out, max_iterations, out, progress)
    return Fit(json.loads(fitted.json), fitted)


def diagnose(
    campaign,
    *,
    fit=None,
    effects=(),
    without=(),
    drag="nonlinear_drag",
    cells=0,
    out=None,
    progress=None,
):
    """Diagnoses a campaign (docs/diagnosis.md): a Campaign, or a folder. Returns a Diagnosis.

    fit: a Fit made here of the same campaign, to begin with. effects, without: names from effects(), all by default.
    out: a folder for diagnosis.json and report.html, where campaign is a folder."""
    if fit is not None and fit._fitted is None:
        raise _core.BadInput("fit: found one that was read from a file, expected one that selvedge.fit made here")
    begun = fit._fitted if fit is not None else None
    found = _core._diagnose(campaign, begun, list(effects), list(without), drag, cells, out, progress)
    return Diagnosis(json.loads(found))


def read_fit(path):
    """A fit.json, or the folder that holds one, as a Fit."""
    return Fit._read(path, "fit.json", "fit/1")


def read_diagnosis(path):
    """A diagnosis.json, or the folder that holds one, as a Diagnosis."""
    return Diagnosis._read(path, "diagnosis.json", "diagnosis/1")
