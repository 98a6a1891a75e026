"""Selvedge: from recorded fabric to simulation parameters, and why the two still differ.

    import selvedge
    campaign = selvedge.read_campaign("runs/denim")
    fit = selvedge.fit(campaign)
    print(fit.parameters["name"], fit.parameters["value"])
    print(selvedge.diagnose(campaign, fit=fit).cause)

SI units, right-handed frame of the motion capture, z up. Points are (N, 3) arrays, m; times (N,), s. Tables are dicts
of columns: pandas.DataFrame(table) makes a frame of one. Long calls leave the interpreter to other threads, show a line
on sys.stderr (progress=False: none, or a function of the share done and what is done), and end on Ctrl-C.
"""

from selvedge._core import (
    BadInput,
    Campaign,
    Corners,
    Fabric,
    Frames,
    Markers,
    Material,
    Motion,
    Parameter,
    Projection,
    Robot,
    Simulation,
    State,
    StripePattern,
    Surface,
    Trial,
    Trials,
    __version__,
    effects,
    read_campaign,
    read_trial,
    simulate,
    write_campaign,
    write_trial,
)
from selvedge.recording import record
from selvedge.results import Diagnosis, Fit, diagnose, fit, read_diagnosis, read_fit

__all__ = [
    "BadInput",
    "Campaign",
    "Corners",
    "Diagnosis",
    "Fabric",
    "Fit",
    "Frames",
    "Markers",
    "Material",
    "Motion",
    "Parameter",
    "Projection",
    "Robot",
    "Simulation",
    "State",
    "StripePattern",
    "Surface",
    "Trial",
    "Trials",
    "diagnose",
    "effects",
    "fit",
    "read_campaign",
    "read_diagnosis",
    "read_fit",
    "read_trial",
    "record",
    "simulate",
    "write_campaign",
    "write_trial",
]
