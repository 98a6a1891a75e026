// The pages that pages.sh keeps, at a phone's, a desk's and a wall's width, in light and dark: no serious or critical
// finding of axe-core, nothing wider than the screen, white in print. Pictures of each go to BUILD/report-screens.
import assert from "node:assert/strict";
import { mkdirSync, readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { build, launch } from "./browser.mjs";

const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const folder = join(build, "report-pages"), shots = join(build, "report-screens");
mkdirSync(shots, { recursive: true });
const names = readdirSync(folder).filter((name) => name.endsWith(".html"));
for (const wanted of ["fit", "diagnosis", "comparison", "calibration", "import", "pictures"])
  assert(names.includes(wanted + ".html"), `no page ${wanted}.html was kept`);

// What lies over what, and how much of it shows, as the reader asks for it.
async function flip() {
  const page = await browser.newPage();
  await page.goto(`file://${join(folder, "pictures.html")}`);
  const shows = (wanted) => page.waitForFunction((opacity) =>
    getComputedStyle(document.querySelector(".pair:not([hidden]) > div + div")).opacity === opacity, {}, wanted);
  await shows("0.5");
  assert.equal(await page.$$eval(".pair[hidden]", (all) => all.length), 1);
  await page.click(".flip");
  for (const wanted of ["1", "0", "1"]) await shows(wanted);
  await page.click(".differ");
  assert.equal(await page.$eval(".flipped", (e) => e.dataset.shown), "difference");
  assert.equal(await page.$eval(".flip", (e) => e.textContent), "Flip");
  await page.select(".which", "1");
  assert.equal(await page.$eval(".pair:not([hidden])", (e) => e.dataset.name), "waving-1, frame 9");
  await page.emulateMediaType("print");
  assert.equal(await page.$$eval(".pair", (all) => all.filter((e) => e.offsetWidth > 0).length), 2);
  await page.close();
}

const browser = await launch(), wrong = [];
try {
  for (const name of names)
    for (const width of [360, 1280, 2560])
      for (const scheme of ["light", "dark"]) {
        const page = await browser.newPage(), where = `${name} at ${width} px, ${scheme}`;
        await page.setViewport({ width, height: 900 });
        await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
        await page.goto(`file://${join(folder, name)}`);
        await page.addScriptTag({ path: axe });
        const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
        for (const v of found.violations)
          if (["serious", "critical"].includes(v.impact))
            wrong.push(`${where}: ${v.id}: ${v.help}: ` +
              v.nodes.slice(0, 3).map((n) => n.html.slice(0, 160)).join(" | "));
        const wide = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
        if (wide > 0) wrong.push(`${where}: ${wide} px wider than the screen`);
        const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
        const isLight = (await ground()) === "rgb(255, 255, 255)";
        if (isLight !== (scheme === "light")) wrong.push(`${where}: its ground is ${await ground()}`);
        await page.screenshot({ path: join(shots, `${name}-${width}-${scheme}.png`), fullPage: true });
        await page.emulateMediaType("print");
        if ((await ground()) !== "rgb(255, 255, 255)") wrong.push(`${where}: printed on ${await ground()}`);
        await page.close();
      }
  await flip();
} finally {
  await browser.close();
}
assert.equal(wrong.length, 0, "\n" + wrong.join("\n"));
console.log(`${names.length} pages, three widths, light and dark: nothing serious, nothing too wide`);
