"""A script without a main guard."""

import sys

sys.exit(0)
