#!/usr/bin/env python3
"""run_commands.py SELVEDGE SOURCE PAGE...: the commands of tutorials, run in order in a folder like a checkout.

A block fenced as ```console holds commands (lines that begin with "$ ", continued after a backslash or by lines that
begin with "> ") and below each what it prints. Shown lines must come in that order in what it prints, on standard
output and then on standard error; others may stand between. In a shown line … stands for any text, and numbers may be a
tenth off. A last line "(exit status N)" says how the command ends; without it, it must end with 0. A block after the
comment <!-- not run --> is left out. Exit status 1 where a command does otherwise, 77 where a page has no commands.
"""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
SPACE = re.compile(r"\s+|-{4,}|─+")


def commands_of(page):
    """[(line of the page, command, shown lines, exit status)]"""
    found, inside, skipped, before = [], False, False, ""
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        text = line.strip()
        if text.startswith("```"):
            inside = not inside and text == "```console"
            skipped = inside and before.startswith("<!-- not run")
        elif inside and not skipped:
            take(found, number, text)
        if text:
            before = text
    return found


def take(found, number, text):
    if text.startswith("$ "):
        found.append([number, text[2:], [], 0])
    elif not found:
        raise SystemExit(f"line {number}: found no command before it, expected one that begins with $")
    elif text.startswith("> ") and not found[-1][2]:
        found[-1][1] += "\n" + text[2:]
    elif found[-1][1].endswith("\\"):
        found[-1][1] = found[-1][1][:-1] + text
    elif ended := re.fullmatch(r"\(exit status (\d+)\)", text):
        found[-1][3] = int(ended[1])
    elif text and text != "…":
        found[-1][2].append(text)


def near(shown, printed):
    a, b = float(shown), float(printed)
    return abs(a - b) <= max(0.1 * abs(a), 2 * 10.0 ** -len(shown.partition(".")[2]) if "." in shown else 0)


def same(shown, printed):
    """Numbers a tenth off; … is any text; how wide a table's columns are does not count."""
    shown, printed = SPACE.sub(" ", shown).strip(), SPACE.sub(" ", printed).strip()
    numbers = NUMBER.findall(shown)
    parts = (re.escape(part) for part in NUMBER.sub("\0", shown).split("…"))
    pattern = ".*".join(parts).replace(re.escape("\0"), "\0").replace("\0", f"({NUMBER.pattern})")
    match = re.fullmatch(pattern, printed)
    return bool(match) and all(near(a, b) for a, b in zip(numbers, match.groups()))


def missing_line(shown, printed):
    """The first shown line that is not printed where it should be."""
    lines = iter(printed)
    for line in shown:
        if not any(same(line, other) for other in lines):
            return line
    return None


def end_what_runs_in(folder):
    """Of a page that was broken off: what its commands left running has its folder there or among its arguments."""
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            arguments = (process / "cmdline").read_text(errors="replace")
            if (process / "cwd").resolve().is_relative_to(folder) or f"{folder}/" in arguments:
                os.kill(int(process.name), signal.SIGTERM)
        except OSError:
            pass  # ended meanwhile, or another user's


def run_page(page, selvedge, source):
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        try:
            return run_in(pathlib.Path(folder).resolve(), page, selvedge, source)
        finally:
            end_what_runs_in(pathlib.Path(folder).resolve())


def run_in(scratch, page, selvedge, source):
    shutil.copytree(source / "examples", scratch / "examples")
    for name, target in (("selvedge", selvedge), ("data", source / "data")):
        (scratch / name).symlink_to(target)
    for number, command, shown, status in commands_of(page):
        ran = subprocess.run(["bash", "-c", command], cwd=scratch, env=os.environ | {"HOME": str(scratch)},
                             stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        where = f"{page.name}:{number}: $ {command}\n"
        if ran.returncode != status:
            return f"{where}ended with {ran.returncode}, expected {status}:\n{ran.stdout}{ran.stderr}"
        printed = (ran.stdout + ran.stderr).splitlines()
        if line := missing_line(shown, printed):
            return f"{where}does not print what is shown:\n{line}\nbut:\n{ran.stdout}{ran.stderr}"
        print(f"{where}as shown ({len(shown)} lines)", flush=True)
    return ""


def check_itself():
    """What is compared loosely, and what is not."""
    assert same("held-out error 1.05 mm", "held-out   error  1.10 mm")
    assert not same("held-out error 1.05 mm", "held-out error 1.50 mm")
    assert same("wrote …/fit.json", "wrote runs/a/fit.json") and not same("wrote", "wrote more")
    assert missing_line(["b"], ["a", "b"]) is None and missing_line(["b", "a"], ["a", "b"]) == "a"


def main(selvedge, source, pages):
    check_itself()
    if not any(commands_of(page) for page in pages):
        print("found no commands, expected blocks fenced as ```console", file=sys.stderr)
        return 77
    for page in pages:
        if problem := run_page(page, selvedge, source):
            print(problem, file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    sys.exit(main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(),
                  [pathlib.Path(page) for page in sys.argv[3:]]))
