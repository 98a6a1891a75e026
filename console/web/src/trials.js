// Past trials: what was recorded beside what the fitted parameters simulate, moment by moment.
import uPlot from "uplot";
import { get } from "./api.js";
import { by, element, notice, number, say } from "./dom.js";
import { Space } from "./space.js";

let space = null, plot = null, trial = null, motion = null, playing = null, listed = "";

const address = (what, index) => `/api/${what}?path=${encodeURIComponent(trial.path)}&index=${index}`;

export async function showTrials() {
  const trials = await get("/api/trials");
  const text = JSON.stringify(trials);
  if (text === listed) return;
  listed = text;
  by("trial-list")
    .replaceChildren(...(trials.length ? trials : [])
                       .map(
                         (t) => element(
                           "button", {
                             role: "option",
                             class: `entry ${t.state} ${t.kept_aside ? "aside" : ""}`,
                             "data-path": t.path,
                             onclick: () => choose(t.path)
                           },
                           element("b", {}, t.path.replaceAll("/", " › ")), element("small", {}, [
                             t.kind, t.frames !== undefined ? `${t.frames} frames` : null,
                             t.frames_lost ? `${t.frames_lost} lost` : null, t.state === "complete" ? null : t.state,
                             t.kept_aside ? "kept aside" : null, t.simulated ? "fitted" : null
                           ].filter(Boolean).join(" · ")))));
  if (!trials.length) by("trial-list").append(element("p", { class: "empty-list" }, "nothing recorded yet"));
}

// Distance of each corner from where it was first, mm.
const travel = (track) => {
  const first = track.find((p) => p[0] !== null) ?? [0, 0, 0];
  return track.map((p) => (p[0] === null ? null : 1e3 * Math.hypot(p[0] - first[0], p[1] - first[1], p[2] - first[2])));
};

function drawPlot() {
  plot?.destroy();
  const box = by("plot"), ink = "#9fb0c6";
  const axis = { stroke: ink, grid: { stroke: "rgba(140,160,190,.14)" }, ticks: { stroke: "rgba(140,160,190,.25)" } };
  plot = new uPlot({
    width: box.clientWidth || 600, height: 190,
    scales: { x: { time: false } },
    legend: { live: false },
    axes: [{ ...axis, label: "time, s" }, { ...axis, label: "corner's way, mm" }],
    series: [{}, { label: "left", stroke: "#6aa9ff", width: 1.6 }, { label: "right", stroke: "#5fe0c8", width: 1.6 }],
    hooks: { draw: [(u) => {
      const x = u.valToPos(time(), "x", true);
      u.ctx.strokeStyle = "#f5b93c";
      u.ctx.lineWidth = 2;
      u.ctx.beginPath();
      u.ctx.moveTo(x, u.bbox.top);
      u.ctx.lineTo(x, u.bbox.top + u.bbox.height);
      u.ctx.stroke();
    }] },
  }, [trial.corners.time_s, travel(trial.corners.left), travel(trial.corners.right)], box);
}

const time = () => trial.frame_time_s[Number(by("scrub").value)] ?? 0;

export async function choose(path) {
  try {
    const chosen = await get(`/api/trial?path=${encodeURIComponent(path)}`);
    motion = null;
    if (chosen.motion)
      motion = new Float32Array(await (await fetch(`/api/motion?path=${encodeURIComponent(path)}`)).arrayBuffer());
    trial = chosen;
  } catch (error) {
    notice(error.message);
    return;
  }
  for (const entry of by("trial-list").children)
    entry.setAttribute("aria-selected", String(entry.dataset.path === path));
  say(by("trial-name"), trial.path.replaceAll("/", " › "));
  const badge = (text, good) => element("span", { class: `pill ${good ? "running" : "degraded"}` }, text);
  by("trial-badges")
    .replaceChildren(
      badge(trial.state, trial.state === "complete"),
      badge(trial.at_rest ? "began at rest" : "not at rest", trial.at_rest),
      ...(trial.frames !== undefined ? [badge(`${trial.frames_lost ?? 0} lost`, !trial.frames_lost)] : []));
  space ??= new Space(by("trial-space"), true);
  space.hideSheet();
  if (trial.motion) space.makeSheet(trial.motion.triangles, trial.motion.vertices);
  by("no-simulated").hidden = Boolean(trial.motion);
  by("simulated").hidden = !trial.motion;
  by("scrub").max = Math.max(0, trial.frame_time_s.length - 1);
  by("scrub").value = 0;
  drawPlot();
  show();
}

// Index of the nearest time.
const nearest = (times, t) => times.reduce((best, v, i) => (Math.abs(v - t) < Math.abs(times[best] - t) ? i : best), 0);

export function show() {
  if (!trial) return;
  const index = Number(by("scrub").value), t = time();
  say(by("scrub-time"), `${number(t, 2)} s · frame ${index}`);
  if (trial.frame_time_s.length) by("recorded").src = address("frame", index);
  if (trial.motion && trial.frame_time_s.length) by("simulated").src = address("simulated", index);
  const k = nearest(trial.corners.time_s, t), at = (track) => track[k]?.[0] !== null;
  space.setMarkers(
    ["left", "right"].filter((n) => at(trial.corners[n])).map((name) => ({ name, at: trial.corners[name][k] })));
  if (motion && trial.motion.time_s.length) {
    const size = 3 * trial.motion.vertices, frame = nearest(trial.motion.time_s, t);
    space.setSheet(motion.subarray(frame * size, (frame + 1) * size));
  }
  plot?.redraw(false, false);
}

export function step(by_frames) {
  const scrub = by("scrub");
  scrub.value = Math.max(0, Math.min(Number(scrub.max), Number(scrub.value) + by_frames));
  show();
}

export function play() {
  if (playing) { clearInterval(playing); playing = null; say(by("play"), "▶"); return; }
  say(by("play"), "❚❚");
  playing = setInterval(() => {
    if (Number(by("scrub").value) >= Number(by("scrub").max)) by("scrub").value = -1;
    step(1);
  }, 100);
}

by("scrub").addEventListener("input", show);
by("play").addEventListener("click", play);
new ResizeObserver(() => {
  if (plot && by("plot").clientWidth > 0) plot.setSize({ width: by("plot").clientWidth, height: 190 });
}).observe(by("plot"));
