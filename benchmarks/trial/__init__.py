"""Robustness and load tests of the service: real servers are killed, flooded, timed and fuzzed from outside.

``python -m benchmarks trial`` runs all `parts`. Each starts `marsupial serve` on its own folder and acts as a
client or kills processes. It returns rows: requirement, finding, and whether the requirement is met.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))  # helpers of the tests
