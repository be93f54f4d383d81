"""The verdict: what a search has found, judged, stated as data and in words, and what to do next."""
