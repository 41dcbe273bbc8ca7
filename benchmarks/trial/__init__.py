"""The service on trial: real servers in processes of their own, killed, flooded, timed and fuzzed from outside.

``python -m benchmarks trial`` runs all `parts`. Each starts `marsupial serve` on a folder of its own, attacks it as a
client or as one who may kill processes, and returns rows: what is required, what was found, whether that is enough.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))  # `servers`, `talk` and others that tests share
