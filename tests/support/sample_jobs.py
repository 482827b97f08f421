"""Jobs of every temper, for the tests of the engine: each is a top-level function, done in a real process."""

import ctypes
import os
import signal
import time

import numpy as np

from touchline.core.errors import FitFailed


def adds(spec, progress):
    for step in range(spec.get("steps", 3)):
        progress(step / 3, f"step {step}")
    return {"sum": spec["a"] + spec["b"], "pid": os.getpid()}


def sleeps_and_says(spec, progress):
    """Stops at its next word when it is cancelled."""
    for step in range(int(spec["seconds"] / 0.01)):
        progress(step * 0.01 / spec["seconds"], "sleeping")
        time.sleep(0.01)
    return {"slept": spec["seconds"]}


def computes_in_silence(spec, progress):
    until = time.monotonic() + spec["seconds"]
    while time.monotonic() < until:
        pass
    return {"late": True}


def refuses(spec, progress):
    raise FitFailed(
        "The left border has 2 points.", "Click two more.", reason="too-few-points", feature="left"
    )


def breaks(spec, progress):
    return dict[str, str]()["nothing"]


def dies(spec, progress):
    how = spec["how"]
    if how in ("SIGKILL", "SIGSEGV", "SIGSTOP"):
        os.kill(os.getpid(), getattr(signal, how))
        time.sleep(60)
    if how == "null pointer":
        ctypes.string_at(0)
    if how == "exit 0":
        os._exit(0)
    if how == "SystemExit":
        raise SystemExit(0)
    if how == "10 GB":
        return float(np.ones(10 << 30, np.uint8)[-1])
    if how == "closed line":
        os.close(0)
        time.sleep(60)
    if how == "flood":
        for _ in range(100_000):
            print("x" * 1000)
        return "flooded"
    raise AssertionError(how)


def answers_much(spec, progress):
    return "x" * spec["bytes"]


def answers_nan(spec, progress):
    return {"value": float("nan"), "list": [1.0, float("inf")]}


def says_its_threads(spec, progress):
    a = np.random.default_rng(0).random((800, 800))
    for _ in range(3):
        a = a @ a / 800
    return {
        "threads": len(os.listdir("/proc/self/task")),
        "token": os.environ.get("TOUCHLINE_TOKEN"),
    }
