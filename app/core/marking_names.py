"""Names of a field's markings in a sentence."""
from app.core.statements import Sentence, say


def marking_name(id: str) -> Sentence | str:
    return id
