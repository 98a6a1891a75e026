// The style sheet of a report: light and dark by the reader's choice, light in print, nothing wider than the screen.
// Plots and drawings keep a light ground of their own.
#pragma once

namespace selvedge::report {

inline constexpr const char* page_style = R"(
:root { color-scheme: light dark; --ink: #111; --ground: #fff; --quiet: #444; --rule: #bbb; --strong: #111;
        --shade: #f6f6f6; --link: #0b4f9e; --good: #2a7a3a; --care: #c78a00; --bad: #b3261e; }
@media screen and (prefers-color-scheme: dark) {
  :root { --ink: #e6e6e3; --ground: #15181b; --quiet: #b9bdc0; --rule: #4b5156; --strong: #c8ccd0;
          --shade: #20252a; --link: #8fbcff; --good: #5fbf74; --care: #e0ab3d; --bad: #f0796f; } }
@media print { :root { color-scheme: light; } }
* { box-sizing: border-box; }
body { font-family: sans-serif; font-size: 15px; line-height: 1.45; color: var(--ink); background: var(--ground);
       max-width: 980px; margin: 2em auto; padding: 0 1em; overflow-wrap: anywhere; }
a { color: var(--link); }
:focus-visible { outline: 3px solid var(--link); outline-offset: 2px; }
.skip { position: absolute; left: -999em; }
.skip:focus { left: 1em; top: .5em; padding: .4em .8em; background: var(--ground); z-index: 1; }
h1 { font-size: 1.7em; border-bottom: 2px solid var(--strong); padding-bottom: .2em; }
h2 { font-size: 1.25em; margin-top: 1.8em; }
nav ul { display: flex; flex-wrap: wrap; gap: .3em 1.2em; padding: 0; margin: .8em 0; list-style: none; }
nav a { display: inline-block; padding: .2em 0; }
.scroll { overflow-x: auto; margin: .8em 0; }
table { border-collapse: collapse; font-size: .93em; }
th, td { border-bottom: 1px solid var(--rule); padding: .22em .8em; text-align: left; vertical-align: top;
         overflow-wrap: normal; }
tr:first-child > * { border-bottom: 2px solid var(--strong); font-weight: bold; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
figure { margin: 1em 0; break-inside: avoid; }
figure img, figure svg { max-width: 100%; height: auto; }
figure svg, img.plot { background: #fff; color: #111; border-radius: 4px; }
figcaption { font-size: .9em; color: var(--quiet); }
.row { display: flex; flex-wrap: wrap; gap: 10px; }
.row figure { flex: 1 1 0; min-width: 150px; margin: 0; }
.row img { width: 100%; image-rendering: pixelated; }
.row img.plot { image-rendering: auto; }
footer { margin-top: 2.5em; border-top: 1px solid var(--rule); font-size: .85em; color: var(--quiet); }
.verdict { border-left: .5em solid; padding: .5em 1em; background: var(--shade); }
.verdict strong { display: block; }
.verdict.full { border-color: var(--good); }
.verdict.limited { border-color: var(--care); }
.verdict.none { border-color: var(--bad); }
@media (max-width: 700px) {
  body { margin: .5em auto; }
  .scroll svg { min-width: 520px; }
  .row .scroll img.plot { width: 408px; max-width: none; }
  .row figure:has(.plot) { min-width: 100%; } }
@media print {
  body { margin: 0; max-width: none; font-size: 11pt; }
  nav, .skip { display: none; }
  .scroll { overflow: visible; } }
)";

}  // namespace selvedge::report
