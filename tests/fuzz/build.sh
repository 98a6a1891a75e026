#!/usr/bin/env bash
# build.sh FOLDER: compiles the fuzzers with clang into FOLDER/bin. Fails, naming the package, where clang or its
# runtime is missing.
set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
folder=$1

missing() { echo "fuzzers: $1 is missing; run: apt-get install --no-install-recommends -y $2" >&2; exit 1; }
command -v clang++-14 >/dev/null || missing clang++-14 clang-14
runtime=$(dirname "$(clang++-14 -print-libgcc-file-name --rtlib=compiler-rt)")
compgen -G "$runtime/libclang_rt.fuzzer*.a" >/dev/null || missing "libclang_rt.fuzzer of clang-14" libclang-rt-14-dev

if [ ! -f "$folder/build.ninja" ]; then
  cmake -S "$here/instrumented" -B "$folder" -G Ninja -DCMAKE_C_COMPILER=clang-14 -DCMAKE_CXX_COMPILER=clang++-14
fi
cmake --build "$folder"
