"""Temporal planning for marsupial robot teams that explore unknown maps."""
