#!/usr/bin/env python3
"""shoot_diagnosis.py REPORT OUT: parts of a diagnosis' report.html as pictures with numbered marks, OUT/PART.png.

    python3 docs/pictures/shoot_diagnosis.py examples/diagnosis/report.html docs/pictures/diagnosis

Needs chromium (packages.txt). The numbers are those of docs/tutorials/reading-a-diagnosis.md.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

# part: (heading it begins with, the things marked 1, 2, … as CSS selectors)
PARTS = {
    "verdict": (None, [".verdict", ".verdict + p"]),
    "budget": ("What takes how much of the gap",
               ["figure", ".scroll:nth-of-type(1) table", ".scroll:nth-of-type(2) table"]),
    "motion": ("In motion", ["figure"]),
    "effects": ("Which effect", ["table tr:nth-child(2)"]),
    "where": ("Where", [".row figure", ".row ~ .row figure, .row ~ figure"]),
}
WIDTH_PX, HIGHEST_PX = 940, 980  # what is lower is cut off

MARKS = """<script>
window.addEventListener("load", () => {
  SELECTORS.forEach((selector, i) => {
    const at = document.querySelector(selector);
    if (!at) return;
    const box = at.getBoundingClientRect(), mark = document.createElement("div");
    mark.textContent = i + 1;
    mark.style.cssText = "position:absolute;left:2px;top:" + (box.top + window.scrollY) + "px;width:22px;height:22px;" +
      "border-radius:11px;background:#c3312b;color:#fff;font:bold 14px/22px sans-serif;text-align:center";
    document.body.append(mark);
  });
  document.title = "height " + Math.ceil(document.body.getBoundingClientRect().bottom + 8);
});
</script>"""


def chromium(*arguments):
    return subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                           "--use-gl=swiftshader", "--virtual-time-budget=4000", *arguments],
                          check=True, capture_output=True, text=True).stdout


def shoot(head, body, selectors, out):
    style = "<style>body{margin:0!important;padding:8px 8px 8px 34px!important}h2{margin-top:.2em!important}</style>"
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "part.html"
        marks = MARKS.replace("SELECTORS", json.dumps(selectors))
        page.write_text(f"{head}{style}{marks}{body}</body></html>", encoding="utf-8")
        size = f"--window-size={WIDTH_PX},600"
        found = re.search(r"<title>height (\d+)", chromium(size, "--dump-dom", page.as_uri()))
        height = min(int(found[1]), HIGHEST_PX)
        chromium(f"--window-size={WIDTH_PX},{height}", f"--screenshot={out}", page.as_uri())


def main(report, out):
    text = report.read_text(encoding="utf-8")
    start, end = text.index("<body>") + len("<body>"), text.rindex("</body>")
    head, sections = text[:start], re.split(r"(?=<h2)", text[start:end])
    out.mkdir(parents=True, exist_ok=True)
    for part, (heading, selectors) in PARTS.items():
        body = sections[0] if heading is None else next(s for s in sections if re.match(f"<h2[^>]*>{heading}<", s))
        shoot(head, body, selectors, (out / f"{part}.png").resolve())
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])))
