"""Situations and map states: made of what was sent, and what can be read off them in a worker."""
