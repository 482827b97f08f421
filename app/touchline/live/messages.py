"""What the server and a camera's process say to each other, in the messages of processes/framing.py.

To the process: START with what it is to read, STREAMS {"streams": […]}, CALIBRATE {"calibration", "picture": … | null}
with the picture that it came from, DETECT {"on", "plan", …} (detector.py), REQUEST {"what", …}. From it: START, STATUS,
PICTURE (number: of the stream), DETECTIONS with a packet of the league or nothing, ANSWER.

A PICTURE's body is byte for byte what a viewer's WebSocket receives, so that the server hands it on without a look.
"""

from touchline.processes.framing import FIRST_KIND

STREAMS, CALIBRATE, DETECT, REQUEST, STATUS, PICTURE, DETECTIONS = range(FIRST_KIND, FIRST_KIND + 7)
