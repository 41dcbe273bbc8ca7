"""The service on trial: real servers in processes of their own, killed, flooded, timed and fuzzed from outside.

Each part starts `marsupial serve` on a folder of its own, attacks it as a client or as one who may kill processes, and
returns rows: what is required, what was found, whether that is enough. Nothing here is used by the service itself.
"""
