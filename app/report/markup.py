"""HTML from Python: every text that goes in is escaped, unless it was made here."""

from collections.abc import Iterable
from html import escape

VOID = {"meta", "br", "img"}


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


def element(name: str, /, *children: object, **attributes: object) -> Html:
    """One element. Children may be lists; None is left out. class_ is class, and stroke_width is stroke-width."""
    words = "".join(f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"'
                    for key, value in attributes.items() if value is not None)
    return Html(f"<{name}{words}>" if name in VOID else f"<{name}{words}>{joined(children)}</{name}>")


def joined(children: Iterable[object]) -> Html:
    """All of them after each other."""
    return Html("".join(_written(child) for child in children))


def _written(child: object) -> str:
    if child is None:
        return ""
    if isinstance(child, Html):
        return child
    return joined(child) if isinstance(child, (list, tuple)) else escape(str(child))
