// The page's stop in a real browser, on a console that is made up: its two ports answer, fail or keep silent as each
// case wants it. Also what the page shows of a stop that lasts, and of a token that is dead.
import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import http from "node:http";
import { join } from "node:path";
import { build, clickSettled, launch, screens, until } from "./browser.mjs";

const types = { html: "text/html", js: "text/javascript", css: "text/css" };
const made = { name: "made up", steps: [], fits: [], diagnoses: [], reports: [] };
const asked = [];           // of both ports: "stop POST /stop", "page POST /api/reset" and so on
const tokens = new Map();   // of the newest request by its path
let answers, state, takesToken;
const listeners = new Set();

function answer(port, how, response) {
  if (how === "silent") return;
  const send = () => {
    if (how === "refuses") return response.destroy();
    const fails = how === "fails";
    response.writeHead(fails ? 500 : 200, { "Content-Type": "application/json", "Access-Control-Allow-Origin": "*" });
    response.end(JSON.stringify(fails ? { error: "the arm has not said that it stopped" } : { stopped: true }));
  };
  setTimeout(send, how === "slow" ? 1500 : 0);
}

const stopPort = http.createServer((request, response) => {
  asked.push(`stop ${request.method} ${request.url}`);
  answer("stop", answers.stop, response);
});

const sendState = (response) => response.write(`event: state\ndata: ${JSON.stringify(state)}\n\n`);

const console_ = http.createServer((request, response) => {
  const path = request.url.split("?")[0];
  if (request.method === "POST") {
    if (path !== "/api/heartbeat") asked.push(`page POST ${path}`);
    tokens.set(path, request.headers["x-selvedge-token"]);
    if (path === "/api/stop") return answer("page", answers.page, response);
    let body = "";
    request.on("data", (text) => { body += text; });
    request.on("end", () => {
      if (path === "/api/answer") asked.push(JSON.parse(body).answer);
      response.writeHead(takesToken ? 200 : 403, { "Content-Type": "application/json" });
      response.end(JSON.stringify(takesToken ? { ok: true } : { error: "no token, or not this console's" }));
    });
    return;
  }
  if (path === "/api/events") {
    response.writeHead(200, { "Content-Type": "text/event-stream" });
    listeners.add(response);
    response.on("close", () => listeners.delete(response));
    return sendState(response);
  }
  if (path === "/api/session") return response.end(JSON.stringify(made));
  if (path === "/api/trials") return response.end("[]");
  const file = join(build, "console-web", path === "/" ? "index.html" : path.slice(1));
  if (path === "/report.html") return response.end("<!DOCTYPE html><title>a report</title><body><p>words</p></body>");
  if (!existsSync(file)) { response.writeHead(404); return response.end(); }
  response.writeHead(200, { "Content-Type": types[file.split(".").pop()] ?? "text/plain" });
  response.end(readFileSync(file, "utf8").replace("{{stop-port}}", String(stopPort.address().port)));
});

const arm = {
  mode: "holds still", armed: false, stop: "", age_s: 0, error_rad: 0, trajectory_s: 0, tool: [0, 0, 0], links: [],
  latched: false, stop_number: 0,
};
const listen = (server) => new Promise((done) => server.listen(0, "127.0.0.1", done));

async function run(browser, url) {
  const page = await browser.newPage();
  const text = (selector) => page.$eval(selector, (node) => node.textContent);
  const kind = () => page.$eval("#stop-state", (node) => (node.hidden ? "" : node.className));
  const shows = (selector) => page.$eval(selector, (node) => node.checkVisibility());
  const begin = async (stop, ofPage) => {
    answers = { stop, page: ofPage };
    asked.length = 0;
    await page.reload({ waitUntil: "domcontentloaded" });
    await until("live state", async () => (await text("#link")) === "live");
  };
  await page.goto(`${url}/#token=right`, { waitUntil: "domcontentloaded" });

  // Both ports are asked at once, with nothing that the browser would have to ask about first; each way of asking.
  const click = () => page.click("#stop"), press = (key) => () => page.keyboard.press(key);
  for (const [name, ask] of Object.entries({ click, space: press(" "), escape: press("Escape") })) {
    await begin("stops", "stops");
    await ask();
    await until(`${name}: stopped`, async () => (await kind()) === "stopped");
    const both = ["stop POST /stop", "page POST /api/stop"];
    await until(`${name}: both ports`, () => both.every((one) => asked.includes(one)));
    assert.equal(asked.length, 2, asked.join(", "));
    assert.equal(tokens.get("/api/stop"), undefined, "a stop carries no token");
  }

  // One port is enough, whatever becomes of the other.
  for (const other of ["silent", "refuses", "fails"]) {
    for (const [stop, ofPage] of [["stops", other], [other, "stops"]]) {
      await begin(stop, ofPage);
      await page.keyboard.press(" ");
      await until(`stop port ${stop}, console ${ofPage}`, async () => (await kind()) === "stopped");
    }
  }

  // Neither: red after half a second, and not before; what comes late is told as late.
  const stopText = /^STOP NOT CONFIRMED, use the arm's own emergency stop/;
  await begin("silent", "silent");
  await page.evaluate(() => {
    let pressed = 0;
    addEventListener("click", () => { pressed = performance.now(); }, true);
    const box = document.getElementById("stop-state");
    new MutationObserver(() => {
      if (box.className === "unconfirmed") window.red_ms ??= performance.now() - pressed;
    }).observe(box, { attributes: true });
  });
  await page.click("#stop");
  assert.notEqual(await kind(), "stopped");
  await until("red", async () => (await kind()) === "unconfirmed");
  assert.match(await text("#stop-state"), stopText);
  const red_ms = await page.evaluate(() => window.red_ms);
  assert.ok(red_ms >= 499, `red after ${red_ms} ms already`);
  await page.screenshot({ path: join(screens, "stop-not-confirmed.png") });
  await begin("slow", "silent");
  await page.click("#stop");
  await until("red", async () => (await kind()) === "unconfirmed");
  await until("late", async () => /^stopped, confirmed after \d+\.\d s$/.test(await text("#stop-state")));

  // Both say that it failed: red at once, and why.
  await begin("fails", "fails");
  await page.click("#stop");
  await until("why", async () => /^STOP NOT CONFIRMED.*the arm has not said/.test(await text("#stop-state")));

  // Keys within a report.
  await begin("stops", "stops");
  await page.keyboard.press("3");
  await page.$eval("#report", (frame) => new Promise((done) => {
    frame.addEventListener("load", done);
    frame.src = "/report.html";
  }));
  await (await (await page.$("#report")).contentFrame()).click("p");
  await page.keyboard.press(" ");
  await until("stopped from within a report", async () => (await kind()) === "stopped");

  // A stop that lasts is lifted by a person who says so twice.
  state.arm = { ...arm, mode: "stopped", stop: "tried", latched: true };
  await begin("stops", "stops");
  await until("the reset", () => shows("#reset"));
  assert.equal(await page.$eval("#arm", (button) => button.disabled), true, "arms while stopped");
  await clickSettled(page, "#reset");
  await clickSettled(page, "#reset-no");
  assert.ok(!asked.includes("page POST /api/reset"));
  await clickSettled(page, "#reset");
  await page.screenshot({ path: join(screens, "stop-reset.png") });
  await clickSettled(page, "#reset-yes");
  await until("asked", () => asked.includes("page POST /api/reset"));
  assert.equal(tokens.get("/api/reset"), "right");
  state.arm = arm;
  for (const listener of listeners) sendState(listener);
  await until("no reset any more", async () => !(await shows("#reset")));

  // A session that was stopped asks for a person's word: one answer.
  state.prompt = { id: 7, step: "reset_stop", text: "The arm was stopped. Is all clear?", age_s: 0 };
  await begin("stops", "stops");
  await until("the prompt", () => shows("#prompt-answers button"));
  const offered = await page.$$eval("#prompt-answers button", (all) => all.map((button) => button.textContent));
  assert.deepEqual(offered, ["reset"]);
  await clickSettled(page, "#prompt-answers button");
  await until("answered", () => asked.includes("reset"));
  delete state.prompt;

  // The badge and what may be recorded follow the devices.
  const cannot = () => page.$eval("#record-start", (button) => button.disabled);
  const device = (name, how = "running") => ({ name, state: how });
  const all = (how) => ["camera", "tracker", "projector"].map((name) => device(name, how));
  const now = (change) => {
    Object.assign(state, change);
    for (const listener of listeners) sendState(listener);
  };
  now({ devices: all("silent") });
  await until("a badge of silence", async () => (await text("#link")) === "no device answers");
  assert.match(await page.$eval("#link", (node) => node.className), /silent/);
  await until("no record", cannot);
  assert.match(await text("#record-why"), /^The camera is silent: .*rig up/);
  now({ devices: [...all("running").slice(0, 2), device("projector", "lost")] });
  await until("who is lost", async () => (await text("#link")) === "projector lost");
  assert.match(await text("#record-why"), /^The projector is lost/);
  now({ devices: all("running"), calibrated: false });
  await until("not calibrated", async () => /not calibrated/.test(await text("#record-why")));
  now({ calibrated: true });
  await until("no markers", async () => /sends no markers/.test(await text("#record-why")));
  now({ markers: { rate_hz: 100, age_s: 0, seen: [] } });
  await until("a record", async () => !(await cannot()));
  assert.equal(await text("#link"), "live");
  assert.equal(await shows("#record-why"), false);
  await page.select("#record [name=kind]", "robot");
  assert.match(await text("#record-why"), /needs an arm/);
  await page.screenshot({ path: join(screens, "record-why.png"), fullPage: true });
  await page.select("#record [name=kind]", "static");
  now({ devices: [] });
  delete state.markers;
  delete state.calibrated;

  // A token that is dead: said, nothing but the stop is offered, and a reload forgets it.
  await begin("stops", "stops");
  assert.equal(await shows("#token-dead"), false);
  takesToken = false;
  await until("the dead token", () => shows("#token-dead"));
  for (const listener of listeners) sendState(listener);
  await until("no arming", () => page.$eval("#arm", (button) => button.disabled));
  await page.keyboard.press(" ");
  await until("stopped without a token", async () => (await kind()) === "stopped");
  await page.screenshot({ path: join(screens, "token-dead.png") });
  await Promise.all([page.waitForNavigation({ waitUntil: "domcontentloaded" }), clickSettled(page, "#reload")]);
  await until("only looks", async () => /may only look/.test(await text("#notice")));
  assert.equal(await page.evaluate(() => sessionStorage.getItem("selvedge-token")), null);
  await page.click("#stop");
  await until("stopped by a page that may only look", async () => (await kind()) === "stopped");
}

let browser, failed = null;
try {
  takesToken = true;
  await listen(stopPort);
  await listen(console_);
  state = { devices: [], rig: "listening", armed_here: false, arm, stop_port: stopPort.address().port };
  setInterval(() => { for (const listener of listeners) sendState(listener); }, 300).unref();
  browser = await launch();
  await run(browser, `http://127.0.0.1:${console_.address().port}`);
  console.log("the page's stop was tried on a console that is made up");
} catch (error) {
  failed = error;
  console.error(error.stack ?? error, asked);
} finally {
  await browser?.close().catch(() => {});
}
process.exit(failed ? 1 : 0);
