"""A fixed, versioned suite of planning situations, with the best plans known for them."""

from marsupial.bench.suite.catalogue import INSTANCES, VERSION, Instance

__all__ = ["INSTANCES", "VERSION", "Instance"]
