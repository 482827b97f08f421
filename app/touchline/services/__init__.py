"""What several routes and sockets share: cameras, caches, long work. No HTTP.

`container.py` holds one of each; routes receive it as `services`. A service takes and returns records and plain JSON.
"""
