"""Writing a plugin: a file to start from, what each kind is checked for, and what a plugin says of itself."""
