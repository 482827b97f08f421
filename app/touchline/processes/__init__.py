"""Child processes: one way to start them, to speak with them, to limit them and to notice their end.

    parent ──start──▶ child_main ──imports, limits, signals──▶ main(connection, arguments)
           ◀──────────── whole messages over one socket ────────────▶

A child is a function `main(connection, arguments)`, named "module:function" in a `Program`; it sends START when it is
ready and ends when its parent's end of the socket closes. Its parent holds a `ChildProcess` (for a thread) or an
`AsyncProcess` (for the event loop), and kills it where it misbehaves: what a stranger's picture, camera or job does to
a child never harms the server.

    start.py          Program, how a process is started from it, and the parent's side for threads: decoders, workers
    child_main.py     the beginning of every child
    framing.py        messages: HEADER and body, over a socket; refusals as they cross it
    limits.py         memory, files and core dumps
    async_process.py  the parent's side for the event loop: cameras, scenes
"""
