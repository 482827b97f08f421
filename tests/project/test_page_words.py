"""The page's words: every text comes from the catalogue, every message is used, and its forms agree."""

import re

import pytest

from tests.support.page_text import texts_outside
from tests.support.paths import NOT_OURS, ROOT, STATIC

WORDS = STATIC / "core" / "words"
CATALOGUES = sorted((WORDS / "en").glob("*.js"))
SCRIPTS = [p for p in sorted(STATIC.rglob("*.js")) if not NOT_OURS & {*p.parts} and WORDS not in p.parents]
ENTRY = re.compile(r'^  "([^"]+)": (.+),$', re.MULTILINE)
FORM = re.compile(r'(zero|one|two|few|many|other): "((?:[^"\\]|\\.)*)"')
KEY = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*(\.[a-z0-9]+(-[a-z0-9]+)*)+")
VALUE = re.compile(r"\{(\w+)\}")


def messages() -> dict[str, str]:
    return {key: text for path in CATALOGUES for key, text in ENTRY.findall(path.read_text(encoding="utf-8"))}


def test_every_catalogue_is_one_message_a_line_in_order_under_its_own_name():
    everywhere: list[str] = []
    for path in CATALOGUES:
        lines = path.read_text(encoding="utf-8").splitlines()
        keys = [key for key, _ in ENTRY.findall("\n".join(lines))]
        assert len(keys) == len(lines) - 3, f"{path.name}: a line that is no message"
        assert keys == sorted(keys), path.name
        assert all(KEY.fullmatch(key) for key in keys), path.name
        prefix = path.stem.removesuffix("_panels").replace("_", "-")
        assert {key.split(".")[0] for key in keys} <= {prefix}, path.name
        assert f'"./en/{path.name}"' in (WORDS / "en.js").read_text(), path.name
        everywhere += keys
    assert len(everywhere) == len({*everywhere}) > 1000


def test_every_message_is_used():
    code = "\n".join(path.read_text(encoding="utf-8") for path in SCRIPTS)
    quoted = {*re.findall(r'"([a-z0-9.-]+)"', code)}
    begun = {begin for begin, inside in re.findall(r"(?:\bt|\brich)\(\s*`([a-z0-9.-]+)(\$\{)", code) if inside}
    unused = [key for key in messages() if key not in quoted and not key.startswith(tuple(begun))]
    assert not unused


def test_every_form_of_a_message_takes_the_same_values():
    several = {key: FORM.findall(text) for key, text in messages().items() if text.startswith("{")}
    assert len(several) > 30
    for key, forms in several.items():
        assert {"one", "other"} <= {category for category, _ in forms}, key
        values = [{*VALUE.findall(text)} - {"count"} for _, text in forms]
        assert all(v == values[0] for v in values), key


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.relative_to(STATIC).as_posix())
def test_no_text_stands_outside_the_catalogue(script):
    found = [*texts_outside(script.read_text(encoding="utf-8"))]
    assert not found, f"move them to {WORDS.relative_to(ROOT)}: {found}"


@pytest.mark.parametrize("source", [
    "html`<p>Saved</p>`", "html`<p>${n} points</p>`", "html`<p>${isOn ? 'on' : 'off'}</p>`",
    "html`<b title='x' aria-label='Save it'/>`",
    "html`<${Fold} title=${isOn ? 'Lines' : t('a.b')} />`", "notify({ text: `No ${n}`, fix: '' })",
    "const a = 'Some words';",
    "html`<i class='big red'>${' and more'}</i>`", "({ label: 'save' })", "const state = { ok: 'Good' };",
    "html`<p>${list.map((x) => html`<b>${x}</b> of them`)}</p>`",
    "html`<p>${t('a.b', { c: isOn ? 'Yes, it is' : '' })}</p>`",
])
def test_a_text_in_the_code_is_noticed(source):
    assert [*texts_outside(source)]


@pytest.mark.parametrize("source", [
    "html`<p class='a b'>${t('a.b')} mm</p>`", "html`<p class=${isOn ? 'warning line' : 'line'}>${n} mm</p>`",
    "throw new Error('Nobody sees this.');", "// Some words", "html`<a href='#/system/jobs'>${number(x)}</a>`",
    "if (event.key === 'Escape') run('save');", "import { x } from './some words.js';",
    "html`<b data-x=${a === 'some words'} />`",
])
def test_what_is_no_text_passes(source):
    assert not [*texts_outside(source)]
