"""One effect that is known to be the cause: its place, shape and size."""
