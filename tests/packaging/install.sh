#!/usr/bin/env bash
# install.sh CMAKE BUILD: installs into a folder of its own and tries what lies there.
set -euo pipefail
cmake=$1 build=$2
[ -f "$build/packaging/selvedge.1" ] || { echo "SKIPPED: installing was NOT tried: the whole project is not built (target all)" >&2; exit 77; }
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
fail() { echo "install.sh: $*" >&2; exit 1; }

"$cmake" --install "$build" --prefix "$prefix" >/dev/null
cd "$prefix"
for file in bin/selvedge lib/selvedge/libselvedge_mpi.so share/man/man1/selvedge.1 share/bash-completion/completions/selvedge \
  lib/udev/rules.d/70-selvedge.rules lib/systemd/system/selvedge@.service lib/sysusers.d/selvedge.conf share/doc/selvedge/docs/fit.md; do
  [ -s "$file" ] || fail "$file is missing"
done
grep -q '^ExecStart=/usr/bin/selvedge daemon' lib/systemd/system/selvedge@.service || fail "the unit does not run the installed binary"

bin/selvedge --help | grep session >/dev/null || fail "--help does not list the commands"
# Its files are those beside it: the default is shown, and a damaged one is refused by its name there.
bin/selvedge demo --help | grep "$prefix/share/selvedge/examples/demo-rig.toml" >/dev/null || fail "demo does not use the installed rig"
echo 'not = [a session' >share/selvedge/examples/experiments/waving.toml
status=0
said=$(bin/selvedge bench fit --quick 2>&1) || status=$?
[ "$status" -eq 2 ] || fail "bench fit ended with $status over a damaged file: $said"
case $said in *"$prefix/share/selvedge/examples/experiments/waving.toml"*) ;; *) fail "another file was read than the installed one: $said" ;; esac

# Trials written and read again.
status=0
bin/selvedge prove format --quick >proof 2>&1 || status=$?
[ "$status" -eq 0 ] || fail "prove format: $(cat proof)"
