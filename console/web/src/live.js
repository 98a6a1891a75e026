// The live view: devices, arm, session, prompts, and recording.
import { get, hasToken, post } from "./api.js";
import { by, element, notice, number, say } from "./dom.js";
import { whyNoRecord } from "./readiness.js";
import { Space } from "./space.js";
import { setStopPort } from "./stop.js";

const space = new Space(by("space"));
const rates = new Map();   // device: the last rates, for its small plot
let armedHere = false, prompted = 0, stood = "", tokenDead = false, last = null;

const may = () => hasToken() && !tokenDead;

const attempt = (request) => request.catch((error) => notice(error.message));

function spark(values) {
  const most = Math.max(...values, 1e-9), width = 64, height = 18;
  const points =
    values.map((v, i) => `${(i * width) / Math.max(values.length - 1, 1)},${height - 1 - (v / most) * (height - 3)}`)
      .join(" ");
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("class", "spark");
  svg.innerHTML = `<polyline points="${points}"/>`;
  return svg;
}

function showDevices(devices) {
  by("devices").replaceChildren(...devices.map((d) => {
    const past = rates.get(d.name) ?? [];
    if (d.rate_hz !== undefined && (past.length === 0 || past.at(-1) !== d.rate_hz)) past.push(d.rate_hz);
    rates.set(d.name, past.slice(-40));
    return element(
      "tr", { title: d.message || "" }, element("th", {}, d.name),
      element("td", {}, element("span", { class: `pill ${d.state}` }, d.state)),
      element("td", { class: "figure" }, d.rate_hz === undefined ? "–" : `${number(d.rate_hz, 0)} /s`),
      element("td", { class: "figure" + (d.drops ? " warn" : "") }, d.drops ?? "–"), element("td", {}, spark(past)));
  }));
}

function showArm(arm) {
  by("arm-card").classList.toggle("absent", !arm);
  if (!arm) return;
  const state = arm.age_s > 2 ? "silent" : arm.armed ? (arm.mode === "moves" ? "moves" : "armed") : arm.mode;
  say(by("arm-state"), state);
  by("arm-state").className = `pill ${
    arm.age_s > 2            ? "silent" :
      arm.mode === "moves"   ? "moving" :
      arm.armed              ? "armed" :
      arm.mode === "stopped" ? "stopped" :
                               "running"}`;
  say(
    by("arm-text"),
    arm.mode === "stopped" && arm.stop ? `stopped: ${arm.stop}` :
                                         `tool at ${arm.tool.map((v) => number(1e3 * v, 0)).join(", ")} mm`);
  by("arm").disabled = armedHere || Boolean(arm.latched) || !may();
  by("disarm").disabled = !armedHere || !may();
  by("latched").hidden = !arm.latched;
  by("reset").disabled = !may();
  if (!arm.latched) askReset(false);
  space.setArm(arm.links, arm.mode === "moves", arm.armed);
}

function showPrompt(prompt) {
  const box = by("prompt");
  box.hidden = !prompt || prompt.step === "done";
  if (box.hidden) { prompted = 0; return; }
  say(by("prompt-title"), { ask: "A step failed", reset_stop: "The arm was stopped" }[prompt.step] ?? "At the rig");
  say(by("prompt-text"), prompt.text);
  if (prompted === prompt.id) return;
  prompted = prompt.id;
  const answers = { ask: ["repeat", "skip", "stop"], change_swatch: ["done"], reset_stop: ["reset"] }[prompt.step] ??
    [];
  by("prompt-answers")
    .replaceChildren(...answers.map(
      (text) => element(
        "button",
        { class: "primary", onclick: () => attempt(post("/api/answer", { prompt: prompt.id, answer: text })) }, text)));
  box.scrollIntoView({ block: "nearest" });   // whoever has scrolled away is asked all the same
}

function showSession(session, recording) {
  const step = session?.step ?? (recording ? "recording" : null);
  say(by("session-step"), step ? step.replaceAll("/", " › ") : "no session runs");
  const done = session?.done ?? -1;
  by("session-bar").style.width = `${Math.max(0, Math.min(1, done)) * 100}%`;
  say(by("session-message"), session?.message ?? "");
}

function check(name, value, good) {
  return element(
    "div", { class: `check ${
               good === null ? "" :
                 good        ? "good" :
                               "bad"}` },
    element("b", {}, value), element("small", {}, name));
}

function showChecks(state) {
  const own = state.record ?? {}, r = state.recording;
  showWhether(state);
  by("record-stop").disabled = !own.running;
  const parts = [];
  if (r)
    parts.push(
      check("frames written", r.frames, null), check("frames durable", r.frames_durable, null),
      check("frames lost", r.lost, r.lost === 0), check("corner samples", r.samples, null));
  const seen = (state.markers?.seen ?? []).map((m) => m.name);
  if (r || own.running)
    parts.push(check(
      "corners seen", `${seen.filter((n) => n === "left" || n === "right").length} of 2`,
      seen.includes("left") && seen.includes("right")));
  if (own.running) parts.push(check(own.trial, `${number(100 * (own.done ?? 0), 0)} %`, null));
  const words = own.running ? own.message : own.ended ? `${own.trial}: ${own.ended}` : "";
  by("checks").replaceChildren(...parts, ...(words ? [element("p", { class: "sub", id: "record-words" }, words)] : []));
}

// A trial that would fail is not offered, and why is said.
function showWhether(state) {
  const kind = by("record").elements.kind.value;
  const why = state.record?.running ? "" : whyNoRecord(state, kind);
  by("record-start").disabled = Boolean(state.record?.running) || !may() || why !== "";
  by("record-why").hidden = why === "";
  say(by("record-why"), why);
}

let states = 0;

export function showState(state) {
  last = state;
  armedHere = state.armed_here;
  setStopPort(state.stop_port);
  showDevices(state.devices);
  showArm(state.arm);
  showPrompt(state.prompt);
  showSession(state.session, state.recording);
  showChecks(state);
  const seen = state.markers?.seen ?? [];
  if (++states % 2) space.setMarkers(state.markers && state.markers.age_s < 2 ? seen : []);
  say(by("space-what"), state.markers ? `${seen.length} markers, ${number(state.markers.rate_hz, 0)} /s` : "");
  say(
    by("pattern"),
    state.pattern ? `projector shows ${state.pattern.kind}${
                      state.pattern.kind === "stripes" ? ` of ${number(state.pattern.period_px, 0)} px` : ""}` :
                                                         "");
}

// What lies on disk: the session's steps and where camera and projector stand.
export async function showRun() {
  const run = await get("/api/session");
  say(by("run-name"), run.name);
  const c = run.calibration;
  // Made once: where they stand changes with a calibration alone.
  const stand = JSON.stringify(c ?? {});
  if (c?.camera?.projection && stand !== stood) {
    stood = stand;
    const devices = [{ ...c.camera, name: "camera", colour: 0x6aa9ff }];
    if (c.projector?.projection) devices.push({ ...c.projector, name: "projector", colour: 0xf5b93c });
    space.setDevices(devices);
  }
  by("steps").replaceChildren(...run.steps.map(
    (s) => element(
      "li", { class: s.state, title: s.why || "" }, element("span", {}, s.step.replaceAll("/", " › ")),
      element("em", {}, s.state === "done" ? `${number(s.seconds, 0)} s` : s.state))));
  return run;
}

export const arm = () => attempt(post("/api/arm"));
export const disarm = () => attempt(post("/api/disarm"));

// The console was started again: all but the stop needs the token of the new one.
export function setTokenDead() {
  tokenDead = true;
  by("token-dead").hidden = false;
}

// Asked within the page: a dialog of the browser would hold up the stop's keys and this page's word that it is there.
function askReset(sure) {
  by("reset").hidden = sure;
  by("reset-sure").hidden = !sure;
}

export function record() {
  if (by("record-start").disabled) return by("record-why").hidden ? undefined : notice(by("record-why").textContent);
  const form = new FormData(by("record"));
  const trial = { name: form.get("name"), kind: form.get("kind"), duration_s: Number(form.get("duration_s")) };
  if (trial.kind !== "static")
    Object.assign(
      trial, { amplitude_m: Number(form.get("amplitude_mm")) / 1e3, frequency_hz: Number(form.get("frequency_hz")) });
  attempt(post("/api/record", trial));
}

by("arm").addEventListener("click", arm);
by("disarm").addEventListener("click", disarm);
by("reset").addEventListener("click", () => askReset(true));
by("reset-no").addEventListener("click", () => askReset(false));
by("reset-yes").addEventListener("click", () => { askReset(false); attempt(post("/api/reset")); });
by("record").elements.kind.addEventListener("change", () => { if (last) showWhether(last); });
by("record").addEventListener("submit", (event) => { event.preventDefault(); record(); });
by("record-stop").addEventListener("click", () => attempt(post("/api/record/stop")));
