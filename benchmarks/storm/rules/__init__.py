"""The rules of the oracle, each a function in a file of its subject; `benchmarks.storm.oracle` has their order.

A rule gets the account of the mission before an event, and the event; it yields a sentence for all that is wrong with
the event. It imports nothing of the product.
"""
