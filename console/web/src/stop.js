// The stop: sent to the stop port and to the console's own port at the same time, for either may be out of reach. The
// page says "stopped" only once one of them has said so, and turns red where neither has within half a second.
import { result } from "./api.js";
import { by, say } from "./dom.js";

const kConfirmed_ms = 500;   // later than this the person must not rely on it
const kGiveUp_ms = 15_000;   // a connection is kept no longer than this
const kShown_ms = 6_000;     // "stopped" stays for so long
const unconfirmed = "STOP NOT CONFIRMED, use the arm's own emergency stop";

let port = Number(document.querySelector("meta[name=stop-port]")?.content) || 0;
let newest = 0, timer = 0;

// The console may have been started again, with another port.
export function setStopPort(number) { if (number) port = number; }

function show(kind, text) {
  const box = by("stop-state");
  clearTimeout(timer);
  box.hidden = false;
  box.className = kind;
  say(box, text);
  if (kind === "stopped") timer = setTimeout(() => { box.hidden = true; }, kShown_ms);
}

// Nothing that the request carries makes the browser ask beforehand whether it may.
const plain = { method: "POST", cache: "no-store", credentials: "omit", keepalive: true };
const send = async (address) => result(await fetch(address, { ...plain, signal: AbortSignal.timeout(kGiveUp_ms) }));

export async function stop() {
  const mine = ++newest, begin = performance.now();
  const ways = [send("/api/stop")];
  if (port) ways.unshift(send(`${location.protocol}//${location.hostname}:${port}/stop`));
  if (by("stop-state").className !== "unconfirmed" || by("stop-state").hidden) show("asked", "stopping …");
  const late = setTimeout(() => { if (mine === newest) show("unconfirmed", unconfirmed); }, kConfirmed_ms);
  try {
    await Promise.any(ways);
    const waited_ms = performance.now() - begin, late_words = `, confirmed after ${(waited_ms / 1e3).toFixed(1)} s`;
    if (mine === newest) show("stopped", `stopped${waited_ms > kConfirmed_ms ? late_words : ""}`);
  } catch (failed) {
    const why = [...new Set(failed.errors.map((error) => error.message))].join("; ");
    if (mine === newest) show("unconfirmed", `${unconfirmed} (${why})`);
  } finally {
    clearTimeout(late);
  }
}
