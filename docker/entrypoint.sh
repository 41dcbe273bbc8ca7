#!/bin/sh
# Puts the compiled kernels where they may be written to, since the rest of the file system is read-only.
set -eu
if [ ! -e "$NUMBA_CACHE_DIR" ]; then
    cp -R /opt/marsupial/kernels "$NUMBA_CACHE_DIR"
fi
exec marsupial "$@"
