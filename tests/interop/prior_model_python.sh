#!/bin/sh
# prior_model_python.sh <write_onnx_samples> <folder> <python> <run.py> <libsplat>: the Python class of models, with a
# sample model.
set -eu
mkdir -p "$2"
"$1" "$2" moge-2-vits
SPLAT_ONNX_SAMPLES=$2
SPLAT_LIBRARY=$5
export SPLAT_ONNX_SAMPLES SPLAT_LIBRARY
exec "$3" "$4" test_priors
