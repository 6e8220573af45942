"""Run the command line as ``python -m tiegocancel``."""

import sys

from tiegocancel.cli import main

sys.exit(main())
