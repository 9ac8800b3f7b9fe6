"""The command line as most tests call it: on one core, and without light that comes by way of other surfaces."""

from __future__ import annotations

from radiosity_addon import command

# To find the light that is missing takes seven times as long as the rest; most tests look at what becomes of light.
FAST = ["--quality", "draft", "--passes", "emit,direct,color"]


def main(words, **options) -> int:
    """``command.main`` with ``--threads 1``, unless the words say otherwise. From two cores on the
    command starts a second process, which takes a second to import the libraries and changes nothing
    in the result, as ``test_same_seed_same_colors_whatever_the_threads`` shows."""
    return command.main(["--threads", "1", *map(str, words)], **options)
