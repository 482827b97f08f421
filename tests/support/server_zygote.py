"""Real servers, one after the other, each of them to be killed at any moment.

Everything is imported once; for each line on standard input a forked child runs the shell's own `serve` on the data
folder, says its address, and serves until it is killed. Then a line `end CODE` follows. The child says `pid PID` first.
"""

import os
import sys
from pathlib import Path

from pydantic import SecretStr

from touchline.main import serve
from touchline.settings import ServerSettings, Settings


def main():
    settings = Settings(
        data=Path(sys.argv[1]),
        server=ServerSettings(port=0),
        database=SecretStr(sys.argv[2]) if len(sys.argv) > 2 else None,
    )
    for _ in sys.stdin:
        child = os.fork()
        if child == 0:
            try:
                os.write(1, f"pid {os.getpid()}\n".encode())
                serve(settings)
            finally:
                os._exit(1)
        _, status = os.waitpid(child, 0)
        os.write(1, f"end {os.waitstatus_to_exitcode(status)}\n".encode())


if __name__ == "__main__":
    main()
