#!/usr/bin/env bash
# develop.sh CMAKE BUILD SOURCE: what the package gives to other programs, from a folder that it is installed in: every
# header compiles with what find_package(Selvedge) names, examples/cpp is built and run, Python imports the module.
set -euo pipefail
cmake=$1 build=$2 source=$3
[ -f "$build/packaging/selvedge.1" ] ||
  { echo "SKIPPED: the installed library was NOT tried: the whole project is not built (target all)" >&2; exit 77; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
prefix=$scratch/prefix
for component in main dev; do
  "$cmake" --install "$build" --prefix "$prefix" --component "$component" >/dev/null
done
cp -R "$source/examples/cpp" "$scratch/example"

# All headers in one go, beside the example. The project's own folder is not among the includes.
{
  cd "$prefix/include/selvedge"
  find . -name '*.h' -not -path './cloth/*kernel/*' | sort | sed 's|^\./\(.*\)|#include "\1"|'
} >"$scratch/example/headers.cpp"
cd "$scratch/example"
[ "$(wc -l <headers.cpp)" -gt 100 ] || { echo "only $(wc -l <headers.cpp) headers are installed" >&2; exit 1; }
echo 'add_library(headers OBJECT headers.cpp)
target_link_libraries(headers PRIVATE Selvedge::Selvedge)
target_compile_options(headers PRIVATE -O0 -w)' >>CMakeLists.txt
"$cmake" -S . -B build -DCMAKE_PREFIX_PATH="$prefix" >/dev/null
grep -q "^Selvedge_DIR:PATH=$prefix/" build/CMakeCache.txt || { echo "another package was found" >&2; exit 1; }
"$cmake" --build build
build/simulate_and_fit

cd "$scratch"
PYTHONPATH=$prefix/lib/python3/dist-packages /usr/bin/python3 -c '
import selvedge
assert selvedge.__file__.startswith("'"$prefix"'"), selvedge.__file__
assert "local_mass" in selvedge.effects()'
