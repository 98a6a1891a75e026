#!/usr/bin/env bash
# fresh_machine.sh BUILD FOLDER: the packages on a Debian 12 that has nothing else, made by debootstrap in FOLDER: they
# install with what the archive has, the demo runs as a user who is nobody else, and again with what a processor
# without AVX gets, the daemons run under systemd on such a one, the C++ example is built against selvedge-dev, the
# notebooks run, so do the tutorials' commands, a first version is upgraded, and removal leaves what users made. Needs
# root and the archive; says how long each step took. Exit 1 where one fails.
set -euo pipefail
build=$(readlink -f "$1") folder=$2
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source=$(readlink -f "$here/../..")
mirror=${SELVEDGE_MIRROR:-http://deb.debian.org/debian}
root=$folder/root
[ "$(id -u)" -eq 0 ] || { echo "fresh_machine.sh: found a user who is not root, expected root (chroot)" >&2; exit 2; }

began=$SECONDS
done_with() { printf '%4d s  %s\n' $((SECONDS - began)) "$*"; began=$SECONDS; }
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 \
  DEBIAN_FRONTEND=noninteractive "$@"; }
as_user() { inside runuser -u weaver -- env HOME=/home/weaver bash -euc "cd; $*"; }
enter() {
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  mount --make-rslave "$root/dev"
  mount -t tmpfs tmpfs "$root/dev/shm"  # of its own: frames of a rig of this host, which is another user's, lie there
}
leave() {
  umount -R "$root/dev" 2>/dev/null || true
  umount "$root/proc" 2>/dev/null || true
}

rm -rf --one-file-system "$folder"
mkdir -p "$folder/packages"
(cd "$build" && cpack -G DEB -B "$folder/packages" >"$folder/cpack.log" 2>&1) ||
  { tail -20 "$folder/cpack.log" >&2; exit 1; }
package() { echo "/packages/$(basename "$folder/packages/$1"_*.deb)"; }
done_with "packages"
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$folder/debootstrap.log" 2>&1 ||
  { tail -20 "$folder/debootstrap.log" >&2; exit 1; }
trap leave EXIT
enter
inside useradd --create-home weaver
done_with "Debian 12"

mkdir "$root/packages"
cp "$folder"/packages/*.deb "$root/packages/"
inside apt-get -qq update
inside apt-get -qq install --no-install-recommends -y "$(package selvedge)" >"$folder/install.log" 2>&1 ||
  { tail -30 "$folder/install.log" >&2; exit 1; }
done_with "selvedge and what it needs are installed"
as_user 'selvedge demo >demo.log 2>&1' || { tail -30 "$root/home/weaver/demo.log" >&2; exit 1; }
as_user 'find runs/demo -name report.html | grep -q .'
done_with "the demo, by a user"
# With the kernels and OpenCV's functions that a processor without AVX gets, at the pace of this one.
without_avx="SELVEDGE_PROCESSOR=plain OPENCV_CPU_DISABLE=FP16,FMA3,AVX,AVX2,AVX512F,AVX512-SKX"
as_user "$without_avx selvedge demo --runs without-avx >without-avx.log 2>&1" ||
  { tail -30 "$root/home/weaver/without-avx.log" >&2; exit 1; }
done_with "the demo, with no more than a processor without AVX has"

inside apt-get -qq install --no-install-recommends -y systemd systemd-sysv dbus udev iproute2 procps \
  linux-image-cloud-amd64 >"$folder/systemd.log" 2>&1 || { tail -30 "$folder/systemd.log" >&2; exit 1; }
leave
"$here/booted_machine.sh" "$root" "$folder/booted" || { tail -30 "$folder/booted/console.log" >&2; exit 1; }
enter
done_with "booted: the daemons under systemd, on a processor without AVX"

inside apt-get -qq install --no-install-recommends -y "$(package selvedge-dev)" cmake g++ make \
  >"$folder/develop.log" 2>&1 || { tail -30 "$folder/develop.log" >&2; exit 1; }
cp -R "$source/examples/cpp" "$root/home/weaver/cpp"
inside chown -R weaver /home/weaver/cpp
as_user 'cmake -S cpp -B cpp/build >/dev/null && cmake --build cpp/build >/dev/null && cpp/build/simulate_and_fit' \
  >"$folder/cpp.log" 2>&1 || { tail -30 "$folder/cpp.log" >&2; exit 1; }
done_with "the C++ example, built against selvedge-dev"

inside apt-get -qq install --no-install-recommends -y python3-numpy jupyter-nbconvert python3-ipykernel \
  python3-matplotlib >"$folder/python.log" 2>&1 || { tail -30 "$folder/python.log" >&2; exit 1; }
cp -R "$source/examples/notebooks" "$root/home/weaver/notebooks"
inside chown -R weaver /home/weaver/notebooks
# shellcheck disable=SC2016
as_user 'cd notebooks && for n in *.ipynb; do jupyter nbconvert --to notebook --execute --output "ran-$n" "$n"; done' \
  >"$folder/notebooks.log" 2>&1 || { tail -30 "$folder/notebooks.log" >&2; exit 1; }
done_with "the notebooks"

cp -R "$source/docs/tutorials" "$source/tests/docs/run_commands.py" "$root/home/weaver/"
inside chown -R weaver /home/weaver/tutorials
as_user 'for page in tutorials/*.md; do
  python3 run_commands.py /usr/bin/selvedge /usr/share/selvedge "$page"
done' >"$folder/tutorials.log" 2>&1 || { tail -30 "$folder/tutorials.log" >&2; exit 1; }
done_with "the tutorials, word for word"

# Over itself, as an upgrade would, then away: what users made and how the machine was set up stay.
mkdir -p "$root/etc/selvedge"
echo "# of this lab" >"$root/etc/selvedge/rig.toml"
inside apt-get -qq install --reinstall --no-install-recommends -y "$(package selvedge)" >>"$folder/install.log" 2>&1
inside apt-get -qq remove -y selvedge selvedge-dev >>"$folder/install.log" 2>&1
grep -q "of this lab" "$root/etc/selvedge/rig.toml"
as_user 'find runs/demo -name report.html | grep -q .'
if inside sh -c 'command -v selvedge'; then exit 1; fi
done_with "installed again, and removed: what users made is left"
