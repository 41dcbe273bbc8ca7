"""The Python API: load scenarios, run missions, plan, show results.

`import marsupial` exports it (``docs/library.md``); the command line and the service call the same functions.
"""
