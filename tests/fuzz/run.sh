#!/usr/bin/env bash
# run.sh FOLDER NAME SECONDS [TABLE]: runs one fuzzer of FOLDER/bin from the kept corpus, and says what it did: one line
# on the standard output and, as a row of Markdown, behind what stands in the file TABLE. Exit 1 after a crash, a
# time-out (10 s an input), memory beyond 2 GiB, or a leak; the input is then left in FOLDER/crashes.
# SELVEDGE_FUZZ_SEED chooses the seed; else it is a random one.
set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
folder=$1 name=$2 seconds=$3 table=${4:-}
program=$folder/bin/fuzz_$name
[ -x "$program" ] || { echo "fuzz.$name: no program $program; tests/fuzz/build.sh makes it" >&2; exit 1; }
seed=${SELVEDGE_FUZZ_SEED:-$(od -An -N4 -tu4 /dev/urandom | tr -d ' ')}
largest=4096
[ "$name" = dlpc350 ] && largest=1536 # each report may be waited for

# New inputs and the files that a decoder reads lie in memory, and go with this script.
work=$(mktemp -d /dev/shm/selvedge-fuzz-XXXXXX)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/new" "$work/files" "$folder/crashes" "$here/corpus/$name"
log=$folder/crashes/$name.log
status=0
SELVEDGE_FUZZ_FOLDER=$work/files "$program" -seed="$seed" -max_total_time="$seconds" -max_len=$largest -timeout=10 \
  -rss_limit_mb=2048 -print_final_stats=1 -verbosity=1 -artifact_prefix="$folder/crashes/$name-" \
  "$work/new" "$here/corpus/$name" >"$log" 2>&1 </dev/null || status=$?

executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -1)
coverage=$(sed -n 's/^.* cov: \([0-9]*\) .*$/\1/p' "$log" | tail -1)
verdict=none
if [ "$status" -ne 0 ]; then
  verdict=$(grep -m1 -E '^(==[0-9]+==ERROR|.*runtime error|SUMMARY)' "$log" || echo "exit $status")
fi
echo "fuzz.$name: ${executions:-?} executions in $seconds s, ${coverage:-?} places covered, seed $seed, crash: $verdict"
if [ -n "$table" ]; then
  echo "| $name | ${executions:-?} | ${coverage:-?} | $seed | ${verdict//|/ } |" >>"$table"
fi
if [ "$status" -ne 0 ]; then
  tail -60 "$log"
  echo "fuzz.$name: the input lies in $folder/crashes; run it again with $program FILE"
  exit 1
fi
