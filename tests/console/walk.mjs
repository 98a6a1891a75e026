// Walks the whole console on a simulated rig: looks, arms, records, stops, scrubs, reads a report; and is refused what
// it must be refused. Screenshots go to BUILD/console-screens/.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { copyFileSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import http from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { binary, build, crowd, launch, median, screens, sleep, source, timeStops, until } from "./browser.mjs";

const folder = mkdtempSync(join(tmpdir(), "selvedge-walk-"));
const processes = [];

const run = (...args) =>
  execFileSync(binary, args, { cwd: folder, stdio: ["ignore", "pipe", "pipe"], timeout: 300_000 }).toString();

function start(name, ...args) {
  const child = spawn(binary, args, { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });
  child.output = "";
  child.stdout.on("data", (text) => { child.output += text; });
  child.stderr.on("data", (text) => { child.output += text; });
  processes.push(child);
  return child;
}

// The short rig of the end-to-end tests on ports of its own, below those that the kernel gives to whoever connects.
function writeRig() {
  const base = 20_000 + Math.floor(Math.random() * 12_000), here = join(source, "tests/end_to_end"),
        socket = join(folder, "p.sock");
  const camera = `127.${100 + Math.floor(Math.random() * 100)}.${Math.floor(Math.random() * 250)}.1`;
  let rig = readFileSync(join(here, "short-rig.toml"), "utf8"),
      world = readFileSync(join(here, "short-world.toml"), "utf8");
  rig = rig.replace("rate_hz = 20", "rate_hz = 10")
          .replace("port = 7667", `port = ${base}`)
          .replace("127.0.16.1", camera)
          .replace("port = 8801", `port = ${base + 1}`)
          .replace("port = 30004", `port = ${base + 2}`)
          .replace("script_port = 50001", `script_port = ${base + 3}`)
          .replace("unix:projector.socket", `unix:${socket}`)
          .replace("data/arms", join(source, "data/arms"));
  world = world.replace("camera_rate_hz = 20", "camera_rate_hz = 10")
            .replace(
              "[devices]",
              `[bus]\nport = ${base}\n[devices]\ncamera_address = "${camera}"\ntracker_port = ${base + 1}\narm_port = ${
                base + 2}\narm_script_port = ${base + 3}\nprojector_socket = "${socket}"\narm_model = "${
                join(source, "data/arms/ur5e.toml")}"`);
  mkdirSync(join(folder, "run"));
  writeFileSync(join(folder, "run/rig.toml"), rig);
  writeFileSync(join(folder, "world.toml"), world);
}

// Status of a request as any program may send it, without a browser's rules.
const status = (port, method, path, headers = {}) => new Promise((done, fail) => {
  const request = http.request({ host: "127.0.0.1", port, method, path, headers }, (answer) => {
    answer.resume();
    done(answer.statusCode);
  });
  request.on("error", fail);
  request.end();
});

async function walk(browser, url, stopPort) {
  const errors = [], page = await browser.newPage();
  page.setDefaultNavigationTimeout(180_000);
  page.on("pageerror", (error) => errors.push(error.message));
  // What is refused on purpose, scripts of a report among it, and what a crowd keeps from its answer, is no fault of
  // the page.
  const expected =
    /40[349]|503|favicon|net::ERR_(CONNECTION|EMPTY|TIMED|SOCKET)|Blocked script execution in '[^']*\/run\//;
  page.on("console", (message) => {
    if (message.type() === "error" && !expected.test(message.text())) errors.push(message.text());
  });
  const text = (selector) => page.$eval(selector, (node) => node.textContent);
  const shot = (name) => page.screenshot({ path: join(screens, `${name}.png`) });
  await page.setViewport({ width: 1440, height: 980 });
  await page.goto(url, { waitUntil: "domcontentloaded" });
  assert.equal(new URL(page.url()).hash, "", "the token stays in the address");

  await until("live state", async () => (await text("#link")).startsWith("live"));
  await until(
    "four devices that run", async () => (await page.$$eval("#devices .pill.running", (all) => all.length)) === 4);
  await until("a live picture", () => page.$eval("#no-preview", (node) => node.hidden));

  // Everything that showed at any time: a busy machine looks too seldom to see it while it shows.
  await page.evaluate(() => {
    window.seen = new Set();
    const look = () => {
      if (!document.getElementById("prompt").hidden) window.seen.add("a prompt");
      if (/frames durable/.test(document.getElementById("checks").textContent)) window.seen.add("frames durable");
      if (document.getElementById("arm-state").textContent === "armed") window.seen.add("armed");
      if (/plain/.test(document.getElementById("quality").textContent)) window.seen.add("stripe quality");
    };
    new MutationObserver(look).observe(
      document.body, { subtree: true, childList: true, attributes: true, characterData: true });
  });
  const seen = (what) => page.evaluate((name) => window.seen.has(name), what);

  // Records under the first name that succeeds: a machine that is busy may spoil a trial.
  const recorded = async (name, kind, seconds, begin, meanwhile) => {
    for (let attempt = 1; attempt <= 8; ++attempt) {
      const called = `${name}-${attempt}`;
      await page.$eval("#record [name=name]", (input, value) => { input.value = value; }, called);
      await page.select("#record [name=kind]", kind);
      await page.$eval("#record [name=duration_s]", (input, value) => { input.value = value; }, String(seconds));
      await begin();
      await until("the trial's beginning", async () => (await text("#checks")).includes(called));
      if (attempt === 1) await meanwhile(called);
      const words = await until(
        "the trial's end",
        async () =>
          (await text("#checks")).match(new RegExp(`${called}: .*(recorded|arrived|hidden|stopped coming).*`))?.[0],
        240);
      if (words.includes(": recorded")) return called;
    }
    throw new Error(`${name} could not be recorded eight times`);
  };

  // A still trial with the mouse; the simulated person hangs the fabric.
  await recorded("still", "static", 3, () => page.click("#record-start"), async () => {
    await until("frames durable", () => seen("frames durable"));
    await shot("live-recording");
  });
  // A waved trial by keyboard.
  const waved = await recorded(
    "waved", "waving", 2.5,
    async () => {
      await page.focus("#tab-live");
      await page.keyboard.press("r");
    },
    async () => {
      await until("a prompt", () => seen("a prompt"));
      await until("stripes judged", () => seen("stripe quality"));
      await shot("live");
    });

  // Arm, see it armed, stop with the space bar. The arm stops by itself where a busy machine renews its lease too late;
  // that is right, and it is armed again.
  const stops = async (what, stop, wanted) => {
    for (let attempt = 0; attempt < 12; ++attempt) {
      if (
        await stop(attempt) &&
        await until(
          "the arm's stop", async () => (await text("#arm-state")) === "stopped" && await text("#arm-text")) &&
        wanted.test(await text("#arm-text")))
        return;
    }
    throw new Error(`${what}: the arm was not stopped so, it says ${await text("#arm-text")}`);
  };
  // A stop holds until the reset is clicked, and clicked again for sure.
  const reset = async () => {
    if (await page.$eval("#latched", (row) => row.hidden)) return;
    for (const button of ["#reset", "#reset-yes"])
      if (await page.$eval(button, (b) => !b.disabled && b.offsetParent !== null)) await page.click(button);
  };
  const armed = async () => {
    await until("the arm can be armed", async () => {
      await reset();
      return page.$eval("#arm", (button) => !button.disabled);
    });
    await page.evaluate(() => window.seen.delete("armed"));
    return true;
  };
  // By its key; again where a busy machine stopped the arm before the page showed it, or lost the key.
  const arms = async () => {
    await armed();
    let pressed_ms = 0;
    await until("armed", async () => {
      if (Date.now() - pressed_ms > 10_000) {
        await reset();
        if (!await page.$eval("#arm", (button) => button.disabled)) {
          await page.keyboard.press("a");
          pressed_ms = Date.now();
        }
      }
      return seen("armed");
    });
  };
  await stops("space bar", async (attempt) => {
    await arms();
    if (attempt === 0) await shot("live-armed");
    await page.keyboard.press(" ");
    return true;
  }, /operator at the console/);
  await shot("live-stopped");

  // Stopped through a hundred streams and a hundred half-open requests at each port. They take the threads that hear
  // this page as well; where it is thought lost before its stop is sent, it is armed again.
  const come = () => [new URL(url).port, stopPort].map((port) => crowd(Number(port)));
  const leave = (crowds) => crowds.forEach((one) => one.leave());
  await stops("through a crowd", async () => {
    await arms();
    const crowds = come();
    await until("the crowd", () => crowds.every((one) => one.opened() >= 200));
    await page.click("#stop");
    await until("stopped", () => page.$eval("#stop-state", (box) => box.className === "stopped"));
    leave(crowds);
    return true;
  }, /operator at the console/);
  await stopThroughACrowd(page, { come, leave }, (i) => (i % 2 ? page.click("#stop") : page.keyboard.press(" ")));
  await until("live again", async () => (await text("#link")).startsWith("live"));
  assert.match(readFileSync(join(folder, "run/console.log"), "utf8"), / 127\.0\.0\.1:\d+ 200 stop/);

  // A lost page stops the arm.
  await stops("lost page", async () => {
    await armed();
    const lost = await browser.newPage();
    lost.setDefaultNavigationTimeout(180_000);
    await lost.setViewport({ width: 480, height: 320 });
    await lost.goto(url, { waitUntil: "domcontentloaded" });
    await until("the second page", async () =>
      (await lost.$eval("#link", (node) => node.textContent)).startsWith("live"));
    await lost.bringToFront();
    await lost.click("#arm");
    await lost.waitForFunction(() => document.getElementById("arm").disabled, { timeout: 60_000 }).catch(() => {});
    await lost.close();
    await page.bringToFront();
    return true;
  }, /has not been heard/);

  // Fitted parameters, then recorded beside simulated.
  run("fit", `run/console/${waved}`, "--out", "run/console", "--cells", "6");
  await page.keyboard.press("2");
  await until("trials", async () => (await page.$$(".entry[data-path]")).length >= 2);
  await until(
    "the fit is noticed", async () => /fitted/.test(await text(`#trial-list .entry[data-path="console/${waved}"]`)));
  await page.click(`#trial-list .entry[data-path="console/${waved}"]`);
  await until(
    "pictures",
    () => page.evaluate(() => ["recorded", "simulated"].every((id) => document.getElementById(id).naturalWidth > 0)));
  await page.focus("#scrub");
  for (let i = 0; i < 12; ++i) await page.keyboard.press("ArrowRight");
  assert.match(await text("#scrub-time"), /frame 12/);
  const settled = () => page.evaluate(
    () => ["recorded", "simulated"].every(
      (id) => document.getElementById(id).complete && document.getElementById(id).src.endsWith("index=12")));
  await until("the twelfth pictures", settled);
  await sleep(300);
  await shot("trials");

  await page.keyboard.press("3");
  await until("the fit's parameters", async () => /Fit of/.test(await text("#summary")));
  await page.click(`#report-list .entry[data-path="console/report.html"]`);
  const frame =
    await until("the report", async () => page.frames().find((f) => f.url().endsWith("/run/console/report.html")));
  await until("the report's words", () => frame.evaluate(() => /90 % interval/.test(document.body?.textContent)));
  const moving = await frame.evaluate(() => document.querySelectorAll(".moving-sheets.runs, .flipped.runs").length);
  assert.equal(moving, 0, "scripts of a report run within the page that stops the arm");
  await shot("results");

  // Tablet width: nothing may stick out.
  await page.setViewport({ width: 820, height: 1180 });
  for (const [key, name] of [["1", "live"], ["2", "trials"], ["3", "results"]]) {
    await page.focus("#tab-live");
    await page.keyboard.press(key);
    await sleep(500);
    const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(over <= 1, `${name} sticks out by ${over} px at tablet width`);
    await shot(`tablet-${name}`);
  }

  // Another site's page may not send anything, and reads nothing.
  const elsewhere = await browser.newPage();
  await elsewhere.goto("about:blank");
  const stolen = await elsewhere.evaluate(
    (address) => fetch(address).then((r) => r.status, () => "refused"), `${new URL(url).origin}/api/trials`);
  assert.ok(stolen === "refused" || stolen === 403, `another origin reads: ${stolen}`);
  assert.deepEqual(errors, [], "errors on the page");
  await page.bringToFront();
  return page;
}

// The stop's time with and without a crowd at both ports: 100 ms are promised on top of what a machine that draws in
// software needs by itself.
async function stopThroughACrowd(page, crowds, click) {
  await timeStops(page);
  const times = async () => {
    await page.evaluate(() => { window.stopTimes.length = 0; });
    for (let i = 0; i < 20; ++i) {
      await click(i);
      await until("stopped", () => page.evaluate((count) => window.stopTimes.length > count, i), 60);
    }
    return page.evaluate(() => window.stopTimes);
  };
  const calm = await times(), before = crowds.come();
  await until("the crowd", () => before.every((one) => one.opened() >= 200));
  const busy = await times();
  crowds.leave(before);
  const text = (all) => `median ${median(all).toFixed(0)} ms, worst of ${all.length} ${Math.max(...all).toFixed(0)} ms`;
  console.log(`click to "stopped" on the page: ${text(calm)}; through a crowd: ${text(busy)}`);
  assert.ok(median(busy) < 100 + 5 * median(calm), `through a crowd: ${text(busy)}`);
}

// The console is started again at the same ports: a page of before has a dead token, and still stops.
async function restart(page, server, port, stopPort) {
  const gone = new Promise((done) => server.on("exit", done));
  server.kill("SIGTERM");
  await gone;
  await page.click("#stop");
  const stopSays = (kind) => until(kind, () => page.$eval("#stop-state", (box, name) => box.className === name, kind));
  await stopSays("unconfirmed");
  const again = start("console", "console", "--run", "run", "--port", String(port), "--stop-port", String(stopPort));
  await until("the console again", () => /stop port/.test(again.output));
  await until("the dead token", () => page.$eval("#token-dead", (node) => !node.hidden));
  await page.click("#stop");
  await stopSays("stopped");
}

async function refusals(url) {
  const port = Number(new URL(url).port), token = new URLSearchParams(new URL(url).hash.slice(1)).get("token");
  assert.equal(await status(port, "POST", "/api/arm"), 403, "no token");
  assert.equal(
    await status(port, "POST", "/api/arm", { "X-Selvedge-Token": token, Origin: "http://elsewhere.example" }), 403,
    "another origin");
  for (const path of ["/run/../world.toml", "/run/%2e%2e/world.toml", "/api/frame?path=../../etc&index=0"])
    assert.ok((await status(port, "GET", path)) >= 400, path);
}

let browser, failed = null;
try {
  writeRig();
  start("devices", "simulate-devices", "--config", "world.toml");
  run("rig", "up", "--config", "run/rig.toml");
  run("calibrate", "--rig", "run/rig.toml", "--out", "run/calibration");
  copyFileSync(join(folder, "run/calibration/calibration.json"), join(folder, "run/calibration.json"));
  const server = start("console", "console", "--run", "run", "--port", "0", "--page-timeout", "3");
  const url = (await until("the console", () => server.output.match(/http:\S+token\S+/)))[0];
  const stopPort = Number((await until("its stop port", () => server.output.match(/stop port: http:\S+:(\d+)\//)))[1]);
  browser = await launch();
  await refusals(url);
  const page = await walk(browser, url, stopPort);
  await restart(page, server, new URL(url).port, stopPort);
  console.log(`the console was walked; screenshots in ${screens}`);
} catch (error) {
  failed = error;
  const page = (await browser?.pages())?.[1];
  await page?.screenshot({ path: join(screens, "failed.png") }).catch(() => {});
  console.error(error.stderr?.toString() ?? "", error.stack ?? error);
  for (const child of processes) console.error(child.output);
} finally {
  await browser?.close().catch(() => {});
  try { run("rig", "down", "--config", "run/rig.toml"); } catch (error) { console.error(error.message); }
  for (const child of processes) child.kill("SIGTERM");
  await sleep(300);
  if (!failed) rmSync(folder, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
