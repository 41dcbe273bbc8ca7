"""What operators decide and see: settings, keys, logs, metrics."""
