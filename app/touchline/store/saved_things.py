"""What errors call that which was to be saved."""

from touchline.core.statements import Sentence, say

CODES = {
    "The archive": "saved.archive", "The calibration": "saved.calibration", "The camera": "saved.camera",
    "The camera's identity": "saved.camera-identity", "The cancelling": "saved.cancelling", "The clip": "saved.clip",
    "The colour profile": "saved.colour-profile", "The database": "saved.database", "The deletion": "saved.deletion",
    "The detection plan": "saved.detection-plan", "The draft": "saved.draft",
    "The field": "saved.field", "The job": "saved.job", "The lens": "saved.lens",
    "The mark of a damaged row": "saved.mark", "The note": "saved.note", "The result": "saved.result",
    "The rig": "saved.rig", "The roll": "saved.roll", "The setting": "saved.setting",
    "The snapshot": "saved.snapshot", "The undoing of the deletion": "saved.undoing"}


def not_saved(what: str) -> Sentence:
    """Return how an error begins. what: as in CODES; another word is stated as it is."""
    return say("saved.not", "{what} was not saved:", what=say(CODES[what], what) if what in CODES else what)


def because(error: str) -> Sentence:
    """Return how an error goes on."""
    return say("disk.cause", "{error}.", error=error)
