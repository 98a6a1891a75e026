#!/usr/bin/env bash
# all.sh FOLDER SECONDS FILE: every fuzzer for so many seconds, as many at a time as there are cores, and what came of
# it as a page of Markdown in FILE. Exit 1 where one found something.
set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
folder=$1 seconds=$2 file=$3
"$here/build.sh" "$folder"
rows=$(mktemp)
trap 'rm -f "$rows"' EXIT
begun=$(date -u +%Y-%m-%dT%H:%M:%SZ)
status=0
names=$(for source in "$here"/fuzz_*.cpp; do basename "$source" .cpp | sed 's/^fuzz_//'; done)
xargs -P "$(nproc)" -I{} "$here/run.sh" "$folder" {} "$seconds" "$rows" <<<"$names" || status=1

commit=$(git -C "$here" rev-parse --short HEAD)
[ -z "$(git -C "$here" status --porcelain -- "$here/../.." ":(exclude)$file")" ] || commit="$commit, with changes"
mkdir -p "$(dirname "$file")"
{
  echo "# Fuzzers: what they did"
  echo
  echo "Written by \`./selvedge test --fuzz $seconds\`; not by hand. Begun $begun, commit $commit, $seconds s each,"
  echo "$(nproc) at a time on $(nproc) cores ($(sed -n 's/^model name\s*: //p' /proc/cpuinfo | head -1)),"
  echo "$(clang++-14 --version | head -1)."
  echo
  echo "| fuzzer | executions | places covered | seed | crash |"
  echo "| --- | ---: | ---: | ---: | --- |"
  sort "$rows"
} >"$file"
echo "written: $file"
exit "$status"
