// The stop: sent to the stop port and to the console's own port at the same time, for either may be out of reach. The page
// says "stopped" only once one of them has said so, and turns red where neither has within half a second.
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
const send = async (address) => result(await fetch(address, { method: "POST", cache: "no-store", credentials: "omit", keepalive: true, signal: AbortSignal.timeout(kGiveUp_ms) }));

export async function stop() {
  const mine = ++newest, begin = performance.now(), waited_s = () => ((performance.now() - begin) / 1e3).toFixed(1);
  const ways = [send("/api/stop")];
  if (port) ways.unshift(send(`${location.protocol}//${location.hostname}:${port}/stop`));
  if (by("stop-state").className !== "unconfirmed" || by("stop-state").hidden) show("asked", "stopping …");
  const late = setTimeout(() => { if (mine === newest) show("unconfirmed", unconfirmed); }, kConfirmed_ms);
  try {
    await Promise.any(ways);
    if (mine === newest) show("stopped", performance.now() - begin > kConfirmed_ms ? `stopped, confirmed after ${waited_s()} s` : "stopped");
  } catch (failed) {
    if (mine === newest) show("unconfirmed", `${unconfirmed} (${[...new Set(failed.errors.map((error) => error.message))].join("; ")})`);
  } finally {
    clearTimeout(late);
  }
}
