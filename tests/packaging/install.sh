#!/usr/bin/env bash
# install.sh CMAKE BUILD: installs into a folder of its own and tries what lies there.
set -euo pipefail
cmake=$1 build=$2
[ -f "$build/packaging/selvedge.1" ] ||
  { echo "SKIPPED: installing was NOT tried: the whole project is not built (target all)" >&2; exit 77; }
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
fail() { echo "install.sh: $*" >&2; exit 1; }

"$cmake" --install "$build" --prefix "$prefix" >/dev/null
cd "$prefix"
for file in bin/selvedge lib/selvedge/selvedge-sim lib/selvedge/selvedge-verify share/man/man1/selvedge-verify.1 \
  lib/selvedge/libselvedge_mpi.so share/man/man1/selvedge.1 share/bash-completion/completions/selvedge \
  lib/udev/rules.d/70-selvedge.rules lib/systemd/system/selvedge@.service lib/sysusers.d/selvedge.conf \
  share/doc/selvedge/docs/fit.md; do
  [ -s "$file" ] || fail "$file is missing"
done
grep -q '^ExecStart=/usr/bin/selvedge daemon' lib/systemd/system/selvedge@.service ||
  fail "the unit does not run the installed binary"

for command in session demo prove; do
  bin/selvedge --help | grep "^  $command " >/dev/null || fail "--help does not list $command"
done
grep '^.SS demo' share/man/man1/selvedge.1 >/dev/null || fail "the manual page lacks demo"
grep '^.SS bench' share/man/man1/selvedge.1 >/dev/null && fail "the manual page has what another package holds"
grep '^.SS bench' share/man/man1/selvedge-verify.1 >/dev/null || fail "the other manual page lacks bench"
# shellcheck disable=SC2016
offered=$(PATH=$prefix/bin:$PATH bash -c 'source share/bash-completion/completions/selvedge
  COMP_WORDS=(selvedge dem) COMP_CWORD=1; _selvedge; echo "${COMPREPLY[*]}"')
[ "$offered" = demo ] || fail "completion offers '$offered' for dem"
# Its files are those beside it: the default is shown, and a damaged one is refused by its name there.
bin/selvedge demo --help | grep "$prefix/share/selvedge/examples/demo-rig.toml" >/dev/null ||
  fail "demo does not use the installed rig"
echo 'not = [a session' >share/selvedge/examples/experiments/waving.toml
status=0
said=$(bin/selvedge bench fit --quick 2>&1) || status=$?
[ "$status" -eq 2 ] || fail "bench fit ended with $status over a damaged file: $said"
case $said in
  *"$prefix/share/selvedge/examples/experiments/waving.toml"*) ;;
  *) fail "another file was read than the installed one: $said" ;;
esac

# Trials written and read again.
status=0
bin/selvedge prove format --quick >proof 2>&1 || status=$?
[ "$status" -eq 0 ] || fail "prove format: $(cat proof)"

# Without the package selvedge-verify: its commands are gone, and an error says where they are.
rm lib/selvedge/selvedge-verify
bin/selvedge --help | grep '^  prove ' >/dev/null && fail "--help lists what is not installed"
status=0
said=$(bin/selvedge prove format 2>&1) || status=$?
[ "$status" -eq 2 ] || fail "prove without its program ended with $status: $said"
case $said in *selvedge-verify*) ;; *) fail "what is missing is not named: $said" ;; esac
said=$(bin/selvedge check "$prefix/nowhere" 2>&1 || true)
case $said in *nowhere*) ;; *) fail "check needs another program: $said" ;; esac
