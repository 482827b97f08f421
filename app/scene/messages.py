"""What goes over the line between the server and a scene's process; the form is live/wire.py's, the kinds are these.

To the process: KEY {"key"} once, SHOW {"number", …as room.py takes it}, SET (look.py), PICTURE {"key"} with a JPEG,
THINGS {"key", "things"}, EXPORT {"number"}. From it: READY {"port"} once, ANSWER {"number", "told" | "problem"} with a
payload where there is one, CLICKED (place.py), VIEWERS {"count"}.
"""

KEY_HEADER = "X-Touchline-Scene"  # where viser's own port wants the key
KEY, DRAW, SET_VIEW, PICTURE, DETECTIONS, EXPORT, READY, ANSWER, CLICKED, VIEWERS = range(10)
