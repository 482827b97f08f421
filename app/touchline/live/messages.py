"""What the server and a camera's process say to each other, in the messages of processes/framing.py.

To the process: START with what it is to read, STREAMS {"streams": […]}, CALIBRATE {"calibration", "picture": … | null}
with the picture that it came from, FOLLOW {"part", "settings"} what a part is to do, REQUEST {"what", …}. From it:
START, STATUS, PICTURE (number: of the stream), FEED (number: of the part) what it sends to its other half, ANSWER.

A PICTURE's body is byte for byte what a viewer's WebSocket receives, so that the server hands it on without a look.
"""

from touchline.processes.framing import FIRST_KIND

STREAMS, CALIBRATE, FOLLOW, REQUEST, STATUS, PICTURE, FEED = range(FIRST_KIND, FIRST_KIND + 7)
