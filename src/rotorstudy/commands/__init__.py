"""The command line: one file per command, with its options in `add` and its action in `run`."""

from rotorstudy.threads import use_one_thread_unless_stated

use_one_thread_unless_stated()
