"""The scene in 3-D: viser draws what app/space has computed. It runs in a process of its own and computes nothing.

    theatre.py        every open scene, started when it is asked for, ended when nobody looks any more
    process.py        one scene's process, seen from the server's event loop
    child.py          that process; child_serving.py does what the server asks
    wire.py           what goes over the line between them
    locked.py         viser on this machine alone, with a key, without tunnels to elsewhere
    room.py           all that one scene shows, and how it is looked at
    look.py           what the page may set: layers, sheets, scale, view
    ground.py         the field        cameras.py   cameras, their pictures and footprints
    clicks.py         rays and misses  sheets.py    expected error
    held_boards.py    a board before a camera
    things.py         a ball and robots, where somebody has detected them
    export.py         the scene as one HTML file that needs no server

viser counts in metres and we in millimetres; METRES stands where one becomes the other.
"""

METRES = 1e-3
