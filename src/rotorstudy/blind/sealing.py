"""Sealing of the truth: its hash is published before the diagnosis, truth and salt after it."""

import hashlib
import json

import numpy as np

from rotorstudy.errors import RotorstudyError

SALT_STREAM = 7


def canonical(truth):
    """The truth as canonical JSON."""
    return json.dumps(truth, sort_keys=True, separators=(",", ":"), allow_nan=False)


def salt_of(seed, index):
    """Salt of a case, drawn from its seed so that the same case has the same seal."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(SALT_STREAM, index))).bytes(16).hex()


def seal(truth, salt):
    """SHA-256 of truth and salt; the salt keeps the truth from being guessed from its hash."""
    return hashlib.sha256((canonical(truth) + salt).encode()).hexdigest()


def check_seal(truth, salt, sealed, where):
    """Raise RotorstudyError if a truth is not the one that was sealed."""
    if seal(truth, salt) != sealed:
        raise RotorstudyError(
            f"{where}: the truth is not the one that was sealed (SHA-256 {seal(truth, salt)}, sealed {sealed}); "
            "it was altered after the diagnosis began. Run the blind tests again"
        )
