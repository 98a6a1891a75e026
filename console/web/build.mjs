// Bundles the page into one script and one style sheet: node build.mjs OUT. Run by ./selvedge after `npm ci`.
import { build } from "esbuild";
import { copyFile, mkdir } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url)), out = process.argv[2];
if (!out) throw new Error("node build.mjs OUT: no folder given");
await mkdir(out, { recursive: true });
await build({
  entryPoints: { app: join(here, "src/main.js") },
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2021",
  outdir: out,
  legalComments: "linked",
  nodePaths: [join(process.cwd(), "node_modules")]
});
await copyFile(join(here, "index.html"), join(out, "index.html"));
