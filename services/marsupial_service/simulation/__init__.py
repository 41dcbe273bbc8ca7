"""Robots that marsupial simulates: in the process of their mission, or in a client that reports for them."""
