"""For operators: metrics, and the maintenance of a store."""
