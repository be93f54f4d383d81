"""What only Chapters 2 to 6 of the thesis need: replay, printed values, errata, checks, scoreboard."""
