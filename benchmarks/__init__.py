"""Programs that measure and try the whole of marsupial: run ``python -m benchmarks NAME`` from the checkout.

- `speed`: how fast it is, beside a reference in the same run.
- `studies`: what batteries, losses and short radios cost missions, and what plans promise.
- `trial`, `storm`, `fuzz`: tests that take too long for `tests`: the service under kills and load, random missions
  judged by an independent oracle, mutated inputs for every reader.
- `figures`: the figures of README and docs, from stored results.

`floors` draws situations and `scenario_files` writes scenarios, for these programs and for `tests`.
"""
