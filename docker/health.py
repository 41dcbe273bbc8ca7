#!/opt/marsupial/bin/python
"""Exits with 0 if the service answers."""

import sys
import urllib.request

with urllib.request.urlopen("http://127.0.0.1:8080/healthz", timeout=4) as answer:
    sys.exit(answer.status != 200)
