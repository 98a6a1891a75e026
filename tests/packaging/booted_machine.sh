#!/usr/bin/env bash
# booted_machine.sh ROOT FOLDER: the Debian in ROOT, on which selvedge is installed, boots under systemd in a virtual
# machine whose processor has no AVX, and does what booted_checks.sh says: called by fresh_machine.sh. Needs root,
# qemu-system-x86 and e2fsprogs. Nothing in ROOT may be mounted. Exit 1 where a check fails or the machine does not get
# to its end; all that it said is in FOLDER/console.log.
set -euo pipefail
root=$(readlink -f "$1") folder=$2
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
limit_s=${SELVEDGE_MACHINE_LIMIT:-3600}
mkdir -p "$folder"

cp "$here/booted_checks.sh" "$root/usr/local/sbin/"
mkdir -p "$root/etc/selvedge"
cp "$root/usr/share/selvedge/examples/demo-world.toml" "$root/etc/selvedge/world.toml"
cp "$root/usr/share/selvedge/examples/demo-rig.toml" "$root/etc/selvedge/rig.toml"
# Where the daemons and the devices start there is no folder that both write.
sed -i 's|projector\.socket|/run/selvedge/&|' "$root/etc/selvedge/world.toml" "$root/etc/selvedge/rig.toml"
echo "# of this lab" >>"$root/etc/selvedge/rig.toml"
# On a real rig the devices are there. Bus messages stay on this host, whose loopback has no route for them yet.
cat >"$root/etc/systemd/system/simulated-devices.service" <<'UNIT'
[Service]
ExecStartPre=+/bin/ip route replace 224.0.0.0/4 dev lo
ExecStart=/usr/bin/selvedge simulate-devices --config /etc/selvedge/world.toml
User=selvedge
RuntimeDirectory=selvedge
RuntimeDirectoryMode=0711
RuntimeDirectoryPreserve=yes
[Install]
WantedBy=multi-user.target
UNIT
cat >"$root/etc/systemd/system/booted-checks.service" <<'UNIT'
[Unit]
After=multi-user.target
[Service]
Type=oneshot
ExecStart=/bin/bash /usr/local/sbin/booted_checks.sh
StandardOutput=tty
StandardError=tty
TTYPath=/dev/ttyS0
[Install]
WantedBy=graphical.target
UNIT
chroot "$root" systemctl enable -q simulated-devices booted-checks \
  selvedge@camera selvedge@tracker selvedge@projector selvedge@arm
chroot "$root" systemctl set-default -q graphical.target
chroot "$root" systemctl mask -q serial-getty@ttyS0

kernel=$(ls "$root"/boot/vmlinuz-* | tail -1)
release=${kernel##*/vmlinuz-}
cp "$kernel" "$root/boot/initrd.img-$release" "$folder/"
rm -f "$folder/disk"
truncate -s 8G "$folder/disk"
mke2fs -q -t ext4 -d "$root" "$folder/disk"
# Instructions are translated: a machine that is virtual itself may offer KVM and hang in it. Nehalem is the last
# processor before AVX.
timeout -k 5 "$limit_s" qemu-system-x86_64 -accel tcg,thread=multi -cpu Nehalem -smp 2 -m 4096 \
  -nographic -nodefaults -serial stdio -net none \
  -kernel "$folder/${kernel##*/}" -initrd "$folder/initrd.img-$release" \
  -append "root=/dev/vda rw console=ttyS0 panic=-1 systemd.show_status=1" \
  -drive "file=$folder/disk,format=raw,if=virtio" </dev/null | stdbuf -oL tr -d '\r' | tee "$folder/console.log" |
  grep --line-buffered '^\(ok\|WRONG\) ' || true
rm -f "$folder/disk"
grep -q '^ok  *all of it' "$folder/console.log" && ! grep -q '^WRONG ' "$folder/console.log"
