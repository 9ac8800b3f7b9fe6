"""The command line as most tests call it: on one core."""

from __future__ import annotations

from radiosity_addon import command


def main(words, **options) -> int:
    """``command.main`` with ``--threads 1``, unless the words say otherwise. From two cores on the
    command starts a second process, which takes a second to import the libraries and changes nothing
    in the result, as ``test_same_seed_same_colors_whatever_the_threads`` shows."""
    return command.main(["--threads", "1", *map(str, words)], **options)
