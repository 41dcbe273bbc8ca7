"""The speed of marsupial beside references of the same run: plain C, scipy, work from scratch, the second use.

``python -m benchmarks analysis|first-use|paths|sim``; docs/benchmarks.md tells how to read what they print.
"""
