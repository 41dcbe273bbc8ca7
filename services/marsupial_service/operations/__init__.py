"""What operators see and do: metrics, and the upkeep of a store."""
