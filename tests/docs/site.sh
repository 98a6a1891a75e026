#!/usr/bin/env bash
# site.sh SOURCE FOLDER: the documentation as a site in FOLDER: every page in a section and no link that leads nowhere
# (build.sh looks after both), a search that knows an effect, and pages of the headers.
set -euo pipefail
source=$1 folder=$2
for program in mkdocs doxygen; do
  command -v "$program" >/dev/null && continue
  if [ "${CI:-}" = true ]; then echo "package $program is not here: the site was NOT made" >&2; exit 1; fi
  echo "SKIPPED: package $program is not installed: the site was NOT made" >&2
  exit 77
done
fail() { echo "site.sh: $*" >&2; exit 1; }

rm -rf "$folder"
"$source/packaging/site/build.sh" "$source" "$folder/site" "$folder/work"
cd "$folder/site"
for page in index.html effects.html tutorials/your-own-csv.html decisions/0001-rooms.html api/index.html; do
  [ -s "$page" ] || fail "$page is missing"
done
grep -q '"location":"effects.html#rig_tilt"' search/search_index.json || fail "search does not know rig_tilt"
grep -rlq 'fit_campaign' api --include='*.html' || fail "the pages of headers lack fit_campaign"
