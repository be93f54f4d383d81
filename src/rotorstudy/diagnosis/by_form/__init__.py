"""One search, in which every cause has an error of its form."""
