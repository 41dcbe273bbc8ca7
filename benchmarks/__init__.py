"""Benchmarks, fuzzers and robustness tests: run ``python -m benchmarks NAME`` from the checkout."""
