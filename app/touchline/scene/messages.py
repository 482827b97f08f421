"""What the server and a scene's process say to each other, in the messages of processes/framing.py.

To the process: START {"key"}, DRAW {…as SceneView.show takes it} and EXPORT {"dark"}, which are answered, SET_VIEW
{…as ViewState has it}, PICTURE {"key"} with a JPEG, DETECTIONS {"key", "things"}. From it: START {"port"}, ANSWER,
CLICKED {…as describe_place returns it}, VIEWERS {"count"}.
"""

from touchline.processes.framing import FIRST_KIND

KEY_HEADER = "X-Touchline-Scene"  # where viser's own port wants the key
DRAW, SET_VIEW, PICTURE, DETECTIONS, EXPORT, CLICKED, VIEWERS = range(FIRST_KIND, FIRST_KIND + 7)
