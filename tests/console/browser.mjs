// What the scripts that drive a browser share.
import { mkdirSync } from "node:fs";
import net from "node:net";
import { join } from "node:path";
import puppeteer from "puppeteer-core";

export const [binary, source, build, chromium] = process.argv.slice(2);
export const screens = join(build, "console-screens");
mkdirSync(screens, { recursive: true });

export const sleep = (ms) => new Promise((wake) => setTimeout(wake, ms));

export async function until(what, test, limit_s = 180) {
  const begin = Date.now();
  while (Date.now() - begin < 1e3 * limit_s) {
    const value = await test();
    if (value) return value;
    await sleep(150);
  }
  throw new Error(`${what}: not within ${limit_s} s`);
}

// Draws in software: a machine without a screen has nothing else.
const drawing = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const args = ["--no-sandbox", "--disable-dev-shm-usage", ...drawing];
export const launch = () => puppeteer.launch({ protocolTimeout: 300_000, executablePath: chromium, args });

// Clicks where the element has come to rest and nothing lies over it: a page that has just been opened still moves.
export async function clickSettled(page, selector) {
  let before = "";
  const at = () => page.$eval(selector, (node) => {
    const box = node.getBoundingClientRect(), x = box.x + box.width / 2, y = box.y + box.height / 2;
    return node.contains(document.elementFromPoint(x, y)) ? `${x} ${y}` : "";
  });
  await until(`${selector} at rest`, async () => {
    const last = before;
    before = await at();
    if (!before) await page.$eval(selector, (node) => node.scrollIntoView({ block: "nearest" }));
    return before && before === last;
  });
  await page.click(selector);
}

// A hundred streams that nobody reads and a hundred requests that stop halfway, at a port, kept up until they are sent
// away.
export function crowd(port) {
  const sockets = new Set();
  let ended = false, open = 0;
  const join = (text) => {
    if (ended) return;
    const socket = net.connect(port, "127.0.0.1", () => { ++open; socket.write(text); socket.pause(); });
    sockets.add(socket);
    socket.on("error", () => {});
    socket.on("close", () => { sockets.delete(socket); setTimeout(join, 5, text); });
  };
  for (let i = 0; i < 100; ++i) {
    join(`GET /api/events HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\n\r\n`);
    join(i % 2 ? "POST /sto" : "POST /api/stop HTTP/1.1\r\nContent-Len");
  }
  return { opened: () => open, leave: () => { ended = true; for (const socket of sockets) socket.destroy(); } };
}

// How long after each click and key press the page said "stopped", in ms; `stopTimes` of the page.
export const timeStops = (page) => page.evaluate(() => {
  if (window.stopTimes) return;
  window.stopTimes = [];
  let pressed = 0;
  const box = document.getElementById("stop-state");
  for (const kind of ["click", "keydown"]) addEventListener(kind, () => { pressed = performance.now(); }, true);
  new MutationObserver(() => {
    if (box.className !== "stopped" || !pressed) return;
    window.stopTimes.push(performance.now() - pressed);
    pressed = 0;
  }).observe(box, { attributes: true, attributeFilter: ["class"] });
});

export const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
