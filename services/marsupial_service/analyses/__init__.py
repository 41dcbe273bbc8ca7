"""Map states, and what can be read off them in a worker."""
