"""What jobs and missions share: entries of the store.

An entry is made once under an idempotency key, stored before it is acknowledged, seen by its owner only, followed event
by event, and removed when it is old. What a job or a mission does beyond that is said in its own package.
"""
