"""What jobs and missions share: entries of the store.

An entry is created once per idempotency key, stored before it is acknowledged, visible only to its owner, followed
event by event, and removed when it is old. Each package, `jobs` and `missions`, adds what is specific to its kind.
"""
