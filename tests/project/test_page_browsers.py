"""The page uses nothing that the oldest supported browsers lack: Firefox 140, Chromium 120 and Safari 16.4."""

import re

import pytest

from tests.support.paths import HELP, NOT_OURS, STATIC

SUPPORTED = ("Firefox ESR (140", "Chromium 120", "Safari 16.4")
SOURCES = [
    p
    for p in STATIC.rglob("*")
    if p.suffix in {".js", ".css", ".html"} and not NOT_OURS & {*p.parts} and "words" not in p.parts
]
# What a newer one has, as it would be written: pattern, example, the first versions with it.
NEWER = {
    "light-dark": (r"light-dark\(", "color: light-dark(#fff, #000)", "Safari 17.5, Chromium 123"),
    "popover": (
        r":popover-open|popovertarget|\bpopover=|(?:show|hide|toggle)Popover",
        "<p popover=auto>",
        "Safari 17",
    ),
    "nesting": (r"(?m)(?:^|[{;])\s*&", ".a { &:hover { color: red; } }", "Safari 16.5"),
    "anchors": (
        r"anchor-name|position-anchor|position-area|anchor\(",
        "position-anchor: --a",
        "Safari 26",
    ),
    "starting style": (r"@starting-style|allow-discrete", "@starting-style { }", "Safari 17.5"),
    "scope": (r"@scope\b", "@scope (.a) { }", "Safari 17.4"),
    "content visibility": (r"content-visibility", "content-visibility: auto", "Safari 18"),
    "field sizing": (r"field-sizing", "field-sizing: content", "Safari 26, Chromium 123"),
    "balanced text": (
        r"text-wrap(?:-style)?:\s*(?:balance|pretty)",
        "text-wrap: balance",
        "Safari 17.5",
    ),
    "sizes of keywords": (
        r"interpolate-size|calc-size\(",
        "interpolate-size: allow-keywords",
        "Chromium 129",
    ),
    "exclusive details": (r"<details[^>]*\bname=", "<details name=a>", "Safari 17.2"),
    "closing dialogs": (r"\bclosedby=", "<dialog closedby=any>", "Chromium 134"),
    "view transitions": (
        r"startViewTransition|@view-transition",
        "document.startViewTransition()",
        "Safari 18",
    ),
    "visibility": (r"\.checkVisibility\(", "it.checkVisibility()", "Safari 17.4"),
    "idle callbacks": (
        r"requestIdleCallback|scheduler\.(?:yield|postTask)",
        "requestIdleCallback(f)",
        "no Safari",
    ),
    "end of scrolling": (r"scrollend", "addEventListener('scrollend', f)", "Safari 26"),
    "resolvers": (r"Promise\.(?:withResolvers|try)\b", "Promise.withResolvers()", "Safari 17.4"),
    "signals of several": (r"AbortSignal\.any\b", "AbortSignal.any([a, b])", "Safari 17.4"),
    "sets": (
        r"\.(?:union|intersection|difference|symmetricDifference|isSubsetOf|isSupersetOf|isDisjointFrom)\(",
        "a.union(b)",
        "Safari 17, Chromium 122",
    ),
    "iterators": (
        r"\.(?:values|keys|entries)\(\)\s*\.(?:map|filter|take|drop|toArray|reduce|some|every|find)\(",
        "map.values().filter(f)",
        "Safari 18.4, Chromium 122",
    ),
    "groups": (r"\b(?:Object|Map)\.groupBy\b", "Object.groupBy(a, f)", "Safari 17.4"),
    "arrays of promises": (r"Array\.fromAsync\b", "Array.fromAsync(a)", "Chromium 121"),
    "addresses": (r"\bURL\.(?:canParse|parse)\(", "URL.canParse(a)", "Safari 17"),
    "base 64": (
        r"\.(?:fromBase64|toBase64|fromHex|toHex)\(",
        "bytes.toBase64()",
        "Safari 18.2, Chromium 140",
    ),
    "escaped patterns": (r"RegExp\.escape\b", "RegExp.escape(a)", "Safari 18.2"),
    "dates": (r"\bTemporal\.|Intl\.DurationFormat", "Temporal.Now", "no Safari"),
}


@pytest.mark.parametrize("feature", NEWER)
def test_no_source_uses_what_a_supported_browser_lacks(feature):
    pattern, example, first = NEWER[feature]
    assert re.search(pattern, example), "the example would not be noticed"
    found = [
        f"{source.relative_to(STATIC)}: {match[0].strip()}"
        for source in SOURCES
        if (match := re.search(pattern, code_of(source)))
    ]
    assert not found, f"only since {first}"


def code_of(source) -> str:
    """Without comments, which may name what is not used; strings stay."""
    return re.sub(
        r"/\*.*?\*/|(?m:(?:^|\s)//[^\n]*)", "", source.read_text(encoding="utf-8"), flags=re.DOTALL
    )


def test_the_manual_names_the_supported_browsers():
    told = (HELP / "troubleshooting.md").read_text(encoding="utf-8")
    assert [name for name in SUPPORTED if name not in told] == []
