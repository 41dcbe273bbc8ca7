"""What benchmarks run on: a fixed, versioned suite of planning situations (`catalogue`), and suites of maps (`maps`).

Situations come with the best plans known for them, maps in two lists: to tune strategies on, and to test them on.
"""
