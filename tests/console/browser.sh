#!/usr/bin/env bash
# browser.sh BINARY SOURCE BUILD [SCRIPT]: a script of this folder or of tests/report, by default walk.mjs, in a real
# browser. What packages.txt and ./selvedge install must be there. The console's stop is tried with it, so it never
# skips: what is missing is a failure.
set -u
binary=$1 source=$2 build=$3 script=${4:-walk.mjs}
fail() { echo "$script was NOT tried in a browser: $*" >&2; exit 1; }
chromium=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
[ -n "$chromium" ] || fail "no chromium on this machine; packages.txt names it: apt-get install chromium"
command -v npm >/dev/null && command -v node >/dev/null || fail "npm is not installed: apt-get install npm"
built="./selvedge test builds it where npm's registry can be reached"
[ -f "$build/console-web/app.js" ] || fail "the page is not built; $built"
[ -d "$build/console-npm/node_modules/puppeteer-core" ] || fail "puppeteer-core is not there; $built"
cp "$source"/tests/console/*.mjs "$source"/tests/report/*.mjs "$build/console-npm/"
cd "$build/console-npm" && exec node "$script" "$binary" "$source" "$build" "$chromium"
