"""The page's English messages by key, as its catalogue has them: a reworded sentence is one edit, in the catalogue."""

import json
import re
from functools import cache
from pathlib import Path

from tests.support.paths import STATIC

WORDS = STATIC / "core" / "words"
CATALOGUES = sorted((WORDS / "en").glob("*.js"))
# languages whose catalogues have what the English ones have
OTHERS = {"de": sorted((WORDS / "de").glob("*.js"))}
STATEMENTS = {"de": sorted((WORDS / "de" / "statements").glob("*.js"))}
ENTRY = re.compile(r'^  "([^"]+)": (.+),$', re.MULTILINE)
FORM = re.compile(r'(zero|one|two|few|many|other): ("(?:[^"\\]|\\.)*")')
OWN = re.compile(
    r"\bownWords\(\{\n  en: \{\n(.*?)\n  \},\n  de: \{\n(.*?)\n  \},\n\}\);", re.DOTALL
)
OWN_ENTRY = re.compile(r'^    "?([\w-]+)"?: (.+),$', re.MULTILINE)
VALUE = re.compile(r"\{(\w+)\}")
TAG = re.compile(r"</?(?:b|code|kbd|small)>")

# What a stranger does not understand, or reads as translated; the word to use instead.
BANNED = {
    r"hats?": "robot top",
    r"strays?": "outlier",
    r"knock\w*": "moved",
    r"anew": "again",
    r"reckon\w*": "compute",
    r"held[ -]out|left out": "cross-validated, excluded",
    r"go(es)? on": "continue",
    r"by (itself|themselves)": "automatically",
    r"at work|long work": "running, job",
    r"clicks": "points",
    r"tells?|told": "report",
    r"stands|holds|foretold": "is, is valid, predicted",
    r"beside": "next to",
    r"burnt": "overexposed",
    r"somebody|nobody": "another user",
    r"pictures? of now": "current image",
    r"cameras? with rays": "physical lens model",
    r"as it hangs": "in its match position",
    r"not known": "unknown",
    r"re-?register\w*": "update the pose",
    r"part in view": "covered area",
    r"bright button": "primary button",
    r"desk": "page",
    r"kept": "saved",
    r"what (it|the camera) sees": "object detection",
    r"look at": "view",
    r"is at it": "computing",
}


def t(key: str, **values: object) -> str:
    """Return the text of a message with its values in their places, without its elements."""
    return VALUE.sub(lambda found: str(values[found[1]]), TAG.sub("", _message(key, values)))


def titled(key: str, **values: object) -> str:
    """Return the same as a title: with a capital."""
    text = t(key, **values)
    return text[:1].upper() + text[1:]


def like(key: str, **values: object) -> re.Pattern:
    """Return what finds a message in a text, whatever stands for the values that are not given."""
    pieces = VALUE.split(TAG.sub("", _message(key, values)))
    return re.compile(
        "".join(
            re.escape(piece)
            if i % 2 == 0
            else re.escape(str(values[piece]))
            if piece in values
            else ".*?"
            for i, piece in enumerate(pieces)
        )
    )


def _message(key: str, values: dict[str, object]) -> str:
    forms = messages()[key]
    return forms["one" if values.get("count") == 1 and "one" in forms else "other"]


@cache
def messages(language: str = "en") -> dict[str, dict[str, str]]:
    """Return the forms of every message by key; a message of one form has that as "other"."""
    return {
        key: forms_of(entry)
        for path in OTHERS.get(language, CATALOGUES)
        for key, entry in entries(path)
    }


def entries(path: Path) -> list[tuple[str, str]]:
    """Return the keys of a catalogue with what stands behind each."""
    return ENTRY.findall(path.read_text(encoding="utf-8"))


def forms_of(entry: str) -> dict[str, str]:
    """Return the forms of what stands behind a key."""
    if entry.startswith('"'):
        return {"other": json.loads(entry)}
    return {category: json.loads(text) for category, text in FORM.findall(entry)}


def own_faults(source: str) -> list[str]:
    """Return what is wrong with the words that a script brings itself, in English and German."""
    found = OWN.search(source)
    if found is None:
        return ["no words in en and de"] if "= ownWords(" in source else []
    english, german = (
        {key: forms_of(entry) for key, entry in OWN_ENTRY.findall(words)}
        for words in found.groups()
    )
    return [
        *(key for key in english.keys() ^ german.keys()),
        *(
            f"{key}: values"
            for key in english.keys() & german.keys()
            if len(
                {
                    str(sorted({*VALUE.findall(text)} - {"count"}))
                    for text in (*english[key].values(), *german[key].values())
                }
            )
            > 1
        ),
        *(f"{key}: unused" for key in english if f't("{key}"' not in source),
        *(
            f"{key}: use {instead}"
            for key, forms in english.items()
            for word, instead in BANNED.items()
            if re.search(rf"\b({word})\b", VALUE.sub("", " ".join(forms.values())), re.IGNORECASE)
        ),
    ]
