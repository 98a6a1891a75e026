#!/usr/bin/env bash
# notebooks.sh FOLDER: every notebook there, executed from the first cell to the last; one that raises fails.
set -euo pipefail
if ! /usr/bin/python3 -c 'import nbconvert, ipykernel, matplotlib' 2>/dev/null; then
  what="packages jupyter-nbconvert, python3-ipykernel, python3-matplotlib are not all here: the notebooks were NOT run"
  [ "${CI:-}" != true ] || { echo "$what; packages.txt has to name them" >&2; exit 1; }
  echo "SKIPPED: $what" >&2
  exit 77
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export IPYTHONDIR=$scratch/ipython JUPYTER_CONFIG_DIR=$scratch/config JUPYTER_RUNTIME_DIR=$scratch/runtime
export JUPYTER_DATA_DIR=$scratch/data MPLCONFIGDIR=$scratch/matplotlib
# The kernel of the interpreter that the module is built for, whichever python3 stands first in PATH.
/usr/bin/python3 -m ipykernel install --prefix "$scratch" --name selvedge >/dev/null 2>&1
export JUPYTER_PATH=$scratch/share/jupyter
cp "$1"/*.ipynb "$scratch/"
cd "$scratch"
for notebook in *.ipynb; do
  grep -q '"output_type"' "$notebook" && { echo "$notebook holds outputs; strip them" >&2; exit 1; }
  /usr/bin/python3 -m nbconvert --to notebook --execute --ExecutePreprocessor.kernel_name=selvedge \
    --ExecutePreprocessor.timeout=900 --output "done-$notebook" "$notebook"
  grep -q '"image/png"' "done-$notebook" || { echo "$notebook drew nothing" >&2; exit 1; }
done
