"""Situations and map states: converted from requests, and analysed in a worker."""
