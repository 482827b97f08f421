"""Touchline for scripts: touchline.Client, over a server or over the application inside this process.

    client.py   Client: each common step of a script as one method, and `call` for everything else; where requests go
    answers.py  what the calls answer, as types; written from the REST description

Importing it loads nothing of the server.
"""
