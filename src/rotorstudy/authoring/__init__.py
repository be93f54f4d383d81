"""Writing a plugin: templates, the invariants of each kind, and the facts stated by a plugin."""
