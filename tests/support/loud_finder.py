"""A child process whose camera library prints while it looks."""

import os

from touchline.sources.discover import in_child


@in_child
def main() -> list:
    os.write(1, b"Loading driver ...")
    return [{"address": "loud://0"}]
