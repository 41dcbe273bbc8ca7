"""The command line: `python -m marsupial`."""

import sys

from marsupial.cli.main import main

if __name__ == "__main__":  # child processes import this module under another name
    sys.exit(main())
