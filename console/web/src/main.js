// The console's page: views, keys, and what keeps them up to date.
import "uplot/dist/uPlot.min.css";
import "./style.css";
import { beat, forgetToken, hasToken, listen, takeToken } from "./api.js";
import { by, notice, say } from "./dom.js";
import * as live from "./live.js";
import { showPreview } from "./preview.js";
import { badge } from "./readiness.js";
import * as results from "./results.js";
import { stop } from "./stop.js";
import * as trials from "./trials.js";

const views = ["live", "trials", "results"];
let shown = "live", linked = false, looks = false, state = null;

function view(name) {
  shown = name;
  for (const other of views) {
    by(other).hidden = other !== name;
    by(`tab-${other}`).setAttribute("aria-selected", String(other === name));
  }
  look();
}

// What lies on disk changes slowly.
async function look() {
  try {
    if (shown === "live") await live.showRun();
    if (shown === "trials") await trials.showTrials();
    if (shown === "results") await results.showResults();
  } catch (error) {
    notice(error.message);
  }
}

function key(event) {
  const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "range" &&
    event.target.type !== "checkbox";
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  // The stop works wherever the focus is, but where a space is a letter. A key that is held down asks once.
  if (event.key === " " && !typing) { event.preventDefault(); if (!event.repeat) stop(); return; }
  if (event.key === "Escape") { event.target.blur?.(); if (!event.repeat) stop(); return; }
  if (typing) return;
  const number = Number(event.key);
  if (number >= 1 && number <= views.length) return view(views[number - 1]);
  if (shown === "live") {
    if (event.key === "a") live.arm();
    if (event.key === "d") live.disarm();
    if (event.key === "r") live.record();
  } else if (shown === "trials") {
    const frames = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -1e9, End: 1e9 }[event.key];
    if (frames && event.target.id !== "trial-space") { event.preventDefault(); trials.step(frames); }
    if (event.key === "p") trials.play();
  }
}

function showBadge() {
  const [text, kind] = badge(linked, state);
  say(by("link"), text);
  by("link").className = `pill ${kind}`;
}

takeToken();
if (!hasToken())
  notice("This page may only look: open the address that ./selvedge console printed, with its token.", "info");
for (const name of views) by(`tab-${name}`).addEventListener("click", () => view(name));
addEventListener("keydown", key, true);
// Keys that are pressed within a report go to its own document.
by("report").addEventListener("load", () => by("report").contentDocument?.addEventListener("keydown", key, true));
by("stop").addEventListener("click", stop);
by("reload").addEventListener("click", () => { forgetToken(); location.reload(); });
listen({
  onState: (newest) => {
    state = newest;
    live.showState(state);
    showBadge();
  },
  onPreview: showPreview,
  onLink: (up) => {
    if (up === linked) return;
    linked = up;
    showBadge();
  },
});
beat((why, status) => {
  if (status === 403) live.setTokenDead();
  else if (linked) notice(`the console does not hear this page: ${why}`);
});
setInterval(async () => {
  if (looks) return;
  looks = true;
  await look();
  looks = false;
}, 2000);
view("live");
