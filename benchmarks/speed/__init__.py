"""The speed of marsupial against references in the same run: plain C, scipy, work from scratch, the second use.

``python -m benchmarks analysis|first-use|paths|sim``; docs/benchmarks.md explains their output.
"""
