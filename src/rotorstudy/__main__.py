"""`python -m rotorstudy` is the command `rotorstudy`."""

import sys

from rotorstudy.commands.line import main

sys.exit(main())
