"""The types in selvedge/__init__.pyi are those of the module: names, attributes, arguments."""

import ast
import inspect
import pathlib
import re
import unittest

import selvedge

STUB = ast.parse((pathlib.Path(selvedge.__file__).parent / "__init__.pyi").read_text(encoding="utf-8"))
FIT = {"parameters": {}, "trials": {}, "campaign": ""}
DIAGNOSIS = {
    "cause": "none", "side": "none", "probabilities": {}, "gap": {"value_mm": 0, "interval_mm": [0, 0]},
    "next_experiment": {"do": ""},
}


# What the name says, with its unit.
PLAIN = {"name", "fabric", "corners", "frame_rate_hz", "exposure_s", "mocap_rate_hz", "cells"}


def public(names):
    return {n for n in names if not n.startswith("_")}


def arguments_of_stub(function):
    """[(name, by keyword alone, has a default)] without self."""
    a = function.args
    defaults = [False] * (len(a.args) - len(a.defaults)) + [True] * len(a.defaults)
    plain = [(x.arg, False, d) for x, d in zip(a.args, defaults) if x.arg != "self"]
    return plain + [(x.arg, True, d is not None) for x, d in zip(a.kwonlyargs, a.kw_defaults)]


def split(text):
    """At commas outside of brackets."""
    parts, depth, part = [], 0, ""
    for c in text:
        depth += (c in "[({") - (c in "])}")
        if c == "," and depth == 0:
            parts.append(part)
            part = ""
        else:
            part += c
    return [p.strip() for p in parts + [part] if p.strip()]


def arguments_of_module(function):
    if inspect.isfunction(function):
        return [
            (p.name, p.kind == p.KEYWORD_ONLY, p.default is not p.empty)
            for p in inspect.signature(function).parameters.values()
            if p.name != "self"
        ]
    # pybind11 says the arguments in the first line of the docstring.
    inside = re.match(r"\w+\((.*)\) -> .*$", function.__doc__.splitlines()[0]).group(1)
    out, keyword = [], False
    for part in split(inside):
        name = part.split(":")[0].strip()
        if part == "*":
            keyword = True
        elif name != "self":
            out.append((name, keyword, "=" in part))
    return out


class Stubs(unittest.TestCase):
    def setUp(self):
        self.classes = {n.name: n for n in STUB.body if isinstance(n, ast.ClassDef)}
        self.functions = {n.name: n for n in STUB.body if isinstance(n, ast.FunctionDef)}

    def test_names(self):
        self.assertEqual(public(self.classes) | public(self.functions), set(selvedge.__all__))
        self.assertTrue(all(getattr(selvedge, n).__doc__ for n in selvedge.__all__))

    def test_functions_take_what_the_stub_says(self):
        for name, stub in self.functions.items():
            with self.subTest(name):
                self.assertEqual(arguments_of_stub(stub), arguments_of_module(getattr(selvedge, name)))

    def test_classes_have_what_the_stub_says(self):
        made = {"Fit": selvedge.Fit(FIT), "Diagnosis": selvedge.Diagnosis(DIAGNOSIS)}
        for name, stub in self.classes.items():
            if name in ("Trials", "BadInput"):  # a list and an error
                continue
            with self.subTest(name):
                there = getattr(selvedge, name)
                has = public(vars(there)) | public(vars(made[name]) if name in made else [])
                methods = {n.name: n for n in stub.body if isinstance(n, ast.FunctionDef)}
                says = public(methods) | {n.target.id for n in stub.body if isinstance(n, ast.AnnAssign)}
                self.assertEqual(says, has)
                for method, function in methods.items():
                    if function.decorator_list or method.startswith("_"):
                        continue
                    self.assertEqual(arguments_of_stub(function), arguments_of_module(getattr(there, method)), method)

    def test_attributes_are_documented(self):
        for name in ("Trial", "Motion", "Simulation", "Corners", "Markers"):
            for attribute in public(vars(getattr(selvedge, name))):
                member = vars(getattr(selvedge, name))[attribute]
                if attribute not in PLAIN:
                    self.assertTrue(member.__doc__, f"{name}.{attribute}")


if __name__ == "__main__":
    unittest.main()
