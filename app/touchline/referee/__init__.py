"""The game controller of a match: which teams play, at which stage, and how high their robots are.

received.py   what a game controller sends, and which of several counts
heights.py    the table of heights by team, its file, and which height a team has
live.py       the thread that listens
service.py    the settings, and the listener that follows them while the server runs
routes.py     /referee
"""
