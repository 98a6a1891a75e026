#!/usr/bin/env bash
# What a machine with selvedge does under systemd, told line by line: "ok" or "WRONG", and what. Runs as root once the
# machine is up (booted_machine.sh), again after its power was cut, and then powers off.
set -u
devices="camera tracker projector arm"
done_before=/var/tmp/booted-once
rig="--config /etc/selvedge/rig.toml"

check() { # check WHAT COMMAND...
  local what=$1; shift
  if "$@" >/tmp/said 2>&1; then echo "ok     $what"; else echo "WRONG  $what"; sed 's/^/       | /' /tmp/said; fi
}
within() { # within SECONDS COMMAND...: until it succeeds
  local until=$((SECONDS + $1)); shift
  until "$@"; do [ "$SECONDS" -lt "$until" ] || return 1; sleep 1; done
}
lab() { runuser -u selvedge -- env RUNTIME_DIRECTORY=/run/selvedge STATE_DIRECTORY=/var/lib/selvedge "$@"; }
main_pid() { systemctl show -P MainPID "selvedge@$1"; }
all_run() { local d; for d in $devices; do systemctl is-active "selvedge@$d" || return 1; done; }
all_deliver() {
  lab selvedge rig status $rig >/tmp/status 2>&1 && ! grep -q degraded /tmp/status || { cat /tmp/status; false; }
}
is_another() { [ "$(main_pid "$1")" != "$2" ] && [ "$(main_pid "$1")" != 0 ] && systemctl is-active "selvedge@$1"; }
stop_holds() { lab selvedge arm status $rig | grep "^stopped, until a person resets it"; }
has_no_avx() { ! grep -qw avx /proc/cpuinfo; }
none_left() { ! pgrep -f "selvedge daemon"; }

first_boot() {
  check "the processor has no AVX" has_no_avx
  check "our own sheet moves there as it should" \
    selvedge simulator check --run-limit 1000 "selvedge simulator serve --cells 4"
  check "all daemons are up after booting" within 120 all_run
  check "every device is running at its rate, none degraded" within 1200 all_deliver
  check "the bus's key is for the daemons' user alone" test "$(stat -c '%U %a' /run/selvedge/bus.key)" = "selvedge 600"
  for device in $devices; do
    local before; before=$(main_pid "$device")
    kill -9 "$before"
    check "the $device's daemon is back after it was killed" within 60 is_another "$device" "$before"
  done
  check "every device is running again" within 1200 all_deliver
  check "a person stops the arm" lab selvedge arm stop $rig
  kill -9 "$(main_pid arm)"
  check "the stop holds after the daemon was killed" within 120 stop_holds
  touch $done_before
  sync $done_before  # of this script alone: the stop is durable by itself
  echo "       the power is cut"
  echo b >/proc/sysrq-trigger
  sleep 60
}

second_boot() {
  check "the stop holds after the power was cut" within 600 stop_holds
  check "a person resets it" lab selvedge arm reset $rig
  check "an upgrade leaves the daemons running" \
    sh -c 'dpkg -i /packages/selvedge_*.deb && systemctl is-active selvedge@arm selvedge@camera'
  sed -i 's/^rate_hz = 30/rate_hz = -30/' /etc/selvedge/rig.toml
  systemctl restart selvedge@camera
  check "a camera with a wrong configuration stays down" within 60 systemctl is-failed selvedge@camera
  check "the journal says why" sh -c 'journalctl -u selvedge@camera | grep "rig.toml.*rate_hz"'
  check "removal" apt-get -qq remove -y selvedge
  check "no daemon is left" within 30 none_left
  check "the rig's configuration is left" grep "of this lab" /etc/selvedge/rig.toml
  check "the folder of the stop is left" test -d /var/lib/selvedge
  echo "ok     all of it was tried"
  sync
  systemctl poweroff
}

if [ -e $done_before ]; then second_boot; else first_boot; fi
