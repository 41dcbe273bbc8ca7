"""Services around marsupial; each is thin: parse a request, call the library, serialise the answer."""
