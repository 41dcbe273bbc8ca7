"""Programs that try marsupial harder than its tests do: run ``python -m benchmarks NAME`` from the checkout."""
