"""A camera's process is ended whenever it is asked to, also in the very moment in which it is ready."""

import asyncio

from touchline.live.supervisor import CameraProcess, CameraSupervisor
from touchline.processes.framing import START, Message, encode_body


class Child:
    """Stands for the process itself."""

    pid = 0

    def kill(self):
        pass

    def wait(self):
        pass


def test_a_camera_that_is_stopped_in_the_moment_in_which_its_process_is_ready_stops(monkeypatch):
    async def story():
        ready, waiting = asyncio.get_running_loop().create_future(), asyncio.Event()

        async def receive(self):
            if ready.done():
                await asyncio.Event().wait()  # a living camera that has nothing to say
            waiting.set()
            return await ready

        async def opened(sock, limit):
            return None, type("Writer", (), {"write": lambda *_: None, "close": lambda *_: None})()

        monkeypatch.setattr(CameraProcess, "receive", receive)
        monkeypatch.setattr("touchline.processes.start.start", lambda program: (Child(), None))
        monkeypatch.setattr(asyncio, "open_connection", opened)
        supervisor = CameraSupervisor("camera north", {}, lambda: None, lambda message: None)
        supervisor.start()
        await waiting.wait()
        ready.set_result(Message(START, 0, encode_body({})))
        async with asyncio.timeout(20):
            await supervisor.stop()

    asyncio.run(story())
