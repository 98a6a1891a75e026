#!/usr/bin/env bash
# build.sh SOURCE OUT WORK: docs/ as a site with search (mkdocs) in OUT, with pages of the installed headers in
# OUT/api (doxygen). README.md is its first page. WORK is made anew. Exit 1 where a page is in no section,
# or a link leads nowhere; what the generator says is in WORK/mkdocs.log.
set -euo pipefail
source=$(readlink -f "$1") out=$(realpath -m "$2") work=$(realpath -m "$3")
here=$source/packaging/site
rm -rf "$work"
mkdir -p "$work" "$(dirname "$out")"
cp -R "$source/docs" "$work/pages"
# What lies beside docs/ in the project lies in it here; the decisions have no page of their own.
for page in README CONTRIBUTING CHANGELOG; do
  sed 's|](docs/decisions)|](decisions/0001-rooms.md)|; s|](docs/|](|g' "$source/$page.md" >"$work/pages/$page.md"
done
mv "$work/pages/README.md" "$work/pages/index.md"
mkdir -p "$work/pages/examples"
cp -R "$source/examples/diagnosis" "$work/pages/examples/"
sed -i 's|](../../examples/|](../examples/|g' "$work"/pages/tutorials/*.md

# Sections of pages that nobody lists by hand.
section() { # section TITLE FOLDER
  printf '  - %s:\n' "$1"
  local page
  for page in "$work/pages/$2"/*.md; do
    printf '      - "%s": %s/%s\n' "$(sed -n '1s/^# *//p' "$page" | tr -d '"')" "$2" "$(basename "$page")"
  done
}
{
  cat "$here/mkdocs.yml"
  section Figures measured
  section Decisions decisions
} >"$work/mkdocs.yml"

headers=$source/packaging/public_headers.txt
{
  sed "s|^STRIP_FROM_PATH.*|STRIP_FROM_PATH = $source|" "$here/Doxyfile"
  printf 'INPUT_FILTER = "awk -f %s/headers.awk"\nOUTPUT_DIRECTORY = %s/doxygen\n' "$here" "$work"
  awk -v from="$source" '$1 == "room" { print "INPUT += " from "/" $2 }
                         $1 == "without" { print "EXCLUDE_PATTERNS += */" $2 }' "$headers"
} >"$work/Doxyfile"
mkdir "$work/doxygen"
(cd "$source" && doxygen "$work/Doxyfile") >"$work/doxygen.log" 2>&1 || { tail -20 "$work/doxygen.log" >&2; exit 1; }
mkdir -p "$work/pages/api"
cp -R "$work/doxygen/html/." "$work/pages/api/"

(cd "$work" && mkdocs build --strict --clean --site-dir "$out") >"$work/mkdocs.log" 2>&1 ||
  { grep -v 'Building\|Cleaning' "$work/mkdocs.log" >&2; exit 1; }
if grep -q 'not included in the "nav"' "$work/mkdocs.log"; then grep '^  - ' "$work/mkdocs.log" >&2; exit 1; fi
