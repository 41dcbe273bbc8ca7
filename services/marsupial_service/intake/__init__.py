"""Convert the bodies of requests to values of the library."""
