// What the rig's devices allow: the words of the badge, and why a trial that is begun now would fail.
const stale_s = 3;   // markers that are older do not come any more
const works = (device) => device.state === "running" || device.state === "degraded";

// [text, kind of pill]. state: as /api/events sends it; none before the first.
export function badge(linked, state) {
  if (!linked) return ["no link", "lost"];
  if (state?.rig === "none") return ["no rig", "degraded"];
  const bad = (state?.devices ?? []).filter((d) => d.state !== "running");
  if (bad.length === 0) return ["live", "running"];
  if (bad.length === state.devices.length && bad.every((d) => d.state === "silent"))
    return ["no device answers", "silent"];
  const words = bad.map((d) => `${d.name} ${d.state}`).join(", ");
  const goesOn = bad.every((d) => d.state === "starting" || d.state === "degraded");
  return goesOn ? [`live, ${words}`, "degraded"] : [words, "lost"];
}

// A sentence, or nothing where nothing stands against it.
export function whyNoRecord(state, kind) {
  if (state.rig === "none") return "No rig: this console was started without a rig's configuration.";
  const needed = kind === "robot" ? ["camera", "tracker", "projector", "arm"] : ["camera", "tracker", "projector"];
  for (const name of needed) {
    const device = (state.devices ?? []).find((d) => d.name === name);
    if (!device) return `A ${kind} trial needs ${name === "arm" ? "an arm" : `a ${name}`}, and this rig has none.`;
    if (!works(device))
      return `The ${name} is ${device.state}${device.message ? ` (${device.message})` : ""}: ` +
        "./selvedge rig status says more, ./selvedge rig up starts it.";
  }
  if (state.calibrated === false) return "Camera and projector are not calibrated yet: ./selvedge calibrate does it.";
  if (!state.markers || state.markers.age_s > stale_s) return "The tracker sends no markers.";
  if (kind === "robot" && state.arm?.latched) return "The arm was stopped: reset the stop first.";
  if (kind === "robot" && !state.armed_here) return "A robot trial moves the arm: arm it first.";
  return "";
}
