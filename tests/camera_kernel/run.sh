#!/usr/bin/env bash
# run.sh BUILD: the V4L2 back-end on the kernel's vivid driver, in a virtual machine (./selvedge test --kernel, which
# installs what this needs: qemu-system-x86, busybox-static, kmod).
#
# Debian's own kernel is unpacked below BUILD/kernel, not installed. The machine boots from memory: a shell, the modules
# that vivid needs, the test program and its libraries. Exit status: the tests', or 1 where the machine did not get to
# them.
set -euo pipefail
build=$(cd "$1" && pwd)
work=$build/kernel
program=$build/bin/test_camera_kernel
limit_s=${SELVEDGE_KERNEL_LIMIT:-900}

say() { printf '%s\n' "$*" >&2; }

mkdir -p "$work"
kernel=$(apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: \(linux-image-[0-9][^ ]*\)$/\1/p' | head -1)
[ -n "$kernel" ] || { say "selvedge: apt knows no linux-image-amd64; apt-get update?"; exit 2; }
release=${kernel#linux-image-}
if [ ! -f "$work/$release/boot/vmlinuz-$release" ]; then
  say "selvedge: fetching $kernel (70 MB)"
  rm -rf "$work/deb" && mkdir -p "$work/deb"
  (cd "$work/deb" && apt-get -qq download "$kernel" 2>/dev/null) ||
    { say "selvedge: $kernel could not be downloaded"; exit 2; }
  dpkg-deb -x "$work"/deb/*.deb "$work/$release.part"
  mv "$work/$release.part" "$work/$release"
  rm -r "$work/deb"
fi
PATH=$PATH:/sbin:/usr/sbin
depmod -b "$work/$release" "$release"

root=$work/root
rm -rf "$root" && mkdir -p "$root"/{bin,modules,proc,sys,dev,tmp}
cp "$(command -v busybox)" "$root/bin/"
cp "$program" "$root/bin/"
ldd "$program" | sed -n 's/.*[[:space:]]\(\/[^ ]*\) (0x.*/\1/p' | while read -r library; do
  mkdir -p "$root$(dirname "$library")"
  cp -L "$library" "$root$library"
done
# modules.dep names what a module needs, nearest first.
order=0
needed=$(sed -n 's/^\(.*\/vivid\.ko[^:]*\): *\(.*\)/\1 \2/p' "$work/$release/lib/modules/$release/modules.dep")
for module in $(tr ' ' '\n' <<< "$needed" | tac); do
  order=$((order + 1))
  cp "$work/$release/lib/modules/$release/$module" \
    "$(printf '%s/modules/%02d-%s' "$root" "$order" "$(basename "$module")")"
done
[ "$order" -gt 0 ] || { say "selvedge: $kernel has no vivid"; exit 1; }
cat > "$root/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox mount -t proc none /proc
/bin/busybox mount -t sysfs none /sys
/bin/busybox mount -t devtmpfs none /dev
/bin/busybox mkdir -p /dev/shm
for module in /modules/*; do /bin/busybox insmod "$module" || echo "no $module"; done
node=
for i in 1 2 3 4 5 6 7 8 9 10; do
  for at in /sys/class/video4linux/video*; do
    case "$(/bin/busybox cat "$at/name" 2>/dev/null)" in *vid-cap*) node=/dev/$(/bin/busybox basename "$at") ;; esac
  done
  [ -n "$node" ] && [ -c "$node" ] && break
  /bin/busybox sleep 1
done
echo "kernel $(/bin/busybox uname -r), node $node"
SELVEDGE_VIVID_NODE=$node /bin/test_camera_kernel
echo "SELVEDGE_EXIT $?"
/bin/busybox poweroff -f
INIT
chmod +x "$root/init"
(cd "$root" && find . | busybox cpio -o -H newc 2>/dev/null | gzip -1 > "$work/root.gz")

say "selvedge: starting kernel $release in a virtual machine (at most $limit_s s)"
log=$work/console.log
# Instructions are translated unless told otherwise: a machine that is virtual itself may offer KVM and hang in it.
# vivid's webcam input alone.
timeout -k 5 "$limit_s" qemu-system-x86_64 -accel "${SELVEDGE_KERNEL_ACCELERATOR:-tcg}" -cpu max -smp 2 -m 1024 \
  -nographic -no-reboot -nodefaults -serial stdio \
  -kernel "$work/$release/boot/vmlinuz-$release" -initrd "$work/root.gz" \
  -append "console=ttyS0 quiet panic=-1 vivid.n_devs=1 vivid.num_inputs=1 vivid.input_types=0" \
  < /dev/null | tee "$log" || true
status=$(sed -n 's/.*SELVEDGE_EXIT \([0-9]*\).*/\1/p' "$log" | tail -1)
[ -n "$status" ] || { say "selvedge: the machine did not finish the tests; its console is in $log"; exit 1; }
exit "$status"
