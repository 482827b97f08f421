"""What industrial cameras are refused with, in the same words whichever way they are reached."""

from app.core.statements import Sentence, say

CANNOT_OPEN = say("industrial.cannot-open", "The camera cannot be opened.")
DOES_NOT_START = say("industrial.does-not-start", "The camera does not start.")
SMALLER_SIZE = say("industrial.smaller-size", "Set a smaller width and height.")


def images_too_large(size_bytes: float) -> Sentence:
    return say("industrial.images-too-large", "The camera reports images of {mb:.0f} MB.", mb=size_bytes / 1e6)
