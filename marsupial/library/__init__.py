"""What others do with marsupial, put together: a scenario found, a mission flown, plans made, results shown.

`import marsupial` offers these to Python (``docs/library.md``); the command line and the service call the same.
"""
