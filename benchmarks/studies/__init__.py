"""What short batteries, lost rovers and short radios cost missions, and what plans promise: many missions, and a table.

``python -m benchmarks batteries|calibration|contact|losses``; docs/benchmarks.md has their figures.
"""
