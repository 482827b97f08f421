"""touchline, every answer of whose API comes late by a random time: races of the page, and of its tests, show.

TOUCHLINE_LATE_MS=500 .venv/bin/python -m pytest tests/e2e     half as long again, at least
"""

import asyncio
import random
import sys
from unittest import mock

from fastapi import FastAPI


def answer_late(most_ms: float) -> None:
    """From now on every call waits before it is heard, and half of them again before the answer is sent."""
    answered = FastAPI.__call__

    def wait():
        return asyncio.sleep(random.random() ** 2 * most_ms / 1000)

    async def late(self, scope, receive, send):
        if scope["type"] != "http" or "/api/" not in scope["path"]:
            return await answered(self, scope, receive, send)

        async def send_late(message):
            if message["type"] == "http.response.start" and random.random() < 0.5:
                await wait()
            await send(message)

        await wait()
        await answered(self, scope, receive, send_late)

    mock.patch.object(FastAPI, "__call__", late).start()


if __name__ == "__main__":
    from touchline.cli import main

    answer_late(float(sys.argv.pop(1)))
    main()
