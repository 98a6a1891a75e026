#!/usr/bin/env bash
# browser.sh BINARY SOURCE BUILD: walks the console in a real browser (walk.mjs). Says loudly what is missing and skips (77).
set -u
binary=$1 source=$2 build=$3
skip() { echo "SKIPPED: the console was NOT tried in a browser: $*" >&2; exit 77; }
[ -n "${SELVEDGE_BROWSER:-}" ] || skip "it draws in software and wants an idle machine; SELVEDGE_BROWSER=1 asks for it, ./selvedge prove station does"
command -v node >/dev/null || skip "node is not installed"
chromium=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
[ -n "$chromium" ] || skip "no chromium on this machine (apt-get install chromium)"
[ -f "$build/console-web/app.js" ] || skip "the page is not built; ./selvedge console builds it where npm's registry can be reached"
[ -d "$build/console-npm/node_modules/puppeteer-core" ] || skip "puppeteer-core is not there; ./selvedge console installs it where npm's registry can be reached"
cp "$source/tests/console/walk.mjs" "$build/console-npm/walk.mjs"
cd "$build/console-npm" && exec node walk.mjs "$binary" "$source" "$build" "$chromium"
