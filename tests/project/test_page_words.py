"""The page's words: every text comes from the catalogue, every message is used, and its forms agree."""

import re

import pytest

from tests.support.page_text import texts_outside
from tests.support.paths import NOT_OURS, PACKAGE, ROOT, STATIC
from tests.support.statements import statements, texts, values_of
from tests.support.words import (
    BANNED,
    CATALOGUES,
    OTHERS,
    STATEMENTS,
    TAG,
    VALUE,
    WORDS,
    entries,
    forms_of,
    like,
    messages,
    own_faults,
    t,
)

SCRIPTS = [
    p for p in sorted(STATIC.rglob("*.js")) if not NOT_OURS & {*p.parts} and WORDS not in p.parents
]
KEY = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*(\.[a-z0-9]+(-[a-z0-9]+)*)+")


def test_every_catalogue_is_one_message_a_line_in_order_under_its_own_name():
    everywhere: list[str] = []
    for path in CATALOGUES:
        keys = [key for key, _ in entries(path)]
        assert len(keys) == len(path.read_text(encoding="utf-8").splitlines()) - 3, (
            f"{path.name}: no message"
        )
        assert keys == sorted(keys), path.name
        assert all(KEY.fullmatch(key) for key in keys), path.name
        prefix = path.stem.removesuffix("_panels").replace("_", "-")
        assert {key.split(".")[0] for key in keys} <= {prefix}, path.name
        assert f'"./en/{path.name}"' in (WORDS / "en.js").read_text(), path.name
        everywhere += keys
    assert len(everywhere) == len({*everywhere}) > 1000


@pytest.mark.parametrize("language", OTHERS)
def test_another_language_has_the_same_messages_with_the_same_values_and_elements(language):
    assert [path.name for path in OTHERS[language]] == [path.name for path in CATALOGUES]
    for theirs, english in zip(OTHERS[language], CATALOGUES, strict=True):
        assert [key for key, _ in entries(theirs)] == [key for key, _ in entries(english)], (
            theirs.name
        )
        assert len(theirs.read_text(encoding="utf-8").splitlines()) == len(
            english.read_text().splitlines()
        )
    for key, forms in messages().items():
        other = messages(language)[key]
        assert {*other} >= {*forms}, key
        for form, text in other.items():
            model = forms.get(form, forms["other"])
            assert {*VALUE.findall(text)} - {"count"} == {*VALUE.findall(model)} - {"count"}, key
            assert sorted(TAG.findall(text)) == sorted(TAG.findall(model)), key
            assert text.strip() or not model.strip(), key


@pytest.mark.parametrize("language", STATEMENTS)
def test_another_language_has_words_for_all_that_the_server_states(language):
    theirs = {
        key: forms_of(entry)["other"]
        for path in STATEMENTS[language]
        for key, entry in entries(path)
    }
    assert len(theirs) == sum(len(entries(path)) for path in STATEMENTS[language]), "one twice"
    assert all(
        [key for key, _ in entries(path)] == sorted(key for key, _ in entries(path))
        for path in STATEMENTS[language]
    )
    whole = {code for code in statements() if "*" not in code}
    varying = [
        re.compile(re.escape(code).replace(r"\*", "[a-z0-9.-]+"))
        for code in statements()
        if re.search(r"\w", code)
    ]
    assert whole - {*theirs} == set(), "no words for them"
    assert {
        code for code in {*theirs} - whole if not any(one.fullmatch(code) for one in varying)
    } - texts() == set(), "never stated"
    for code in whole:
        if statements()[code] is not None:
            assert values_of(theirs[code]) == values_of(statements()[code]), code


def test_what_is_common_is_no_message_of_a_part_again():
    """Single words apart, which may mean something else elsewhere."""

    def said(key):
        return VALUE.sub("{}", str([messages(language)[key] for language in ("en", *OTHERS)]))

    common = {said(key) for key in messages() if key.startswith("common.")}
    assert not [
        key
        for key in messages()
        if not key.startswith("common.") and said(key) in common and "{}" in said(key)
    ]


def test_every_message_is_used():
    code = "\n".join(path.read_text(encoding="utf-8") for path in SCRIPTS)
    quoted = {*re.findall(r'"([a-z0-9.-]+)"', code)}
    begun = tuple({*re.findall(r"(?:\bt\(|\brich\(|\bnameOr\()\s*`([a-z0-9.-]+)\$\{", code)})
    assert not [key for key in messages() if key not in quoted and not key.startswith(begun)]


def test_every_form_of_a_message_takes_the_same_values():
    several = {key: forms for key, forms in messages().items() if len(forms) > 1}
    assert len(several) > 30
    for key, forms in several.items():
        assert {"one", "other"} <= {*forms}, key
        values = [{*VALUE.findall(text)} - {"count"} for text in forms.values()]
        assert all(v == values[0] for v in values), key


@pytest.mark.parametrize(("word", "instead"), BANNED.items())
def test_no_message_uses_a_word_that_a_stranger_does_not_understand(word, instead):
    banned = re.compile(rf"\b({word})\b", re.IGNORECASE)
    found = {
        key: text
        for key, forms in messages().items()
        for text in forms.values()
        if banned.search(VALUE.sub("", text))
    }
    assert not found, f"use {instead}"


def test_words_that_a_script_brings_itself_agree():
    assert {
        path.name: faults
        for path in SCRIPTS
        if (faults := own_faults(path.read_text(encoding="utf-8")))
    } == {}


@pytest.mark.parametrize(
    ("english", "german", "fault"),
    [
        ('a: "{n} of them"', 'a: "{n} davon"', []),
        ('a: "Save"', 'b: "Speichern"', ["a", "b"]),
        ('a: "{n} of them"', 'a: "davon"', ["a: values"]),
        ('b: "Save"', 'b: "Speichern"', ["b: unused"]),
        ('a: "Anew"', 'a: "Nochmals"', ["a: use again"]),
    ],
)
def test_a_fault_in_them_would_be_seen(english, german, fault):
    source = f'const t = ownWords({{\n  en: {{\n    {english},\n  }},\n  de: {{\n    {german},\n  }},\n}});\nt("a");'
    assert sorted(own_faults(source)) == fault


def test_a_test_reads_the_form_that_the_count_asks_for():
    assert [t("common.points", count=n) for n in (0, 1, 2)] == ["0 points", "1 point", "2 points"]
    assert like("common.activate-version").search("Press Activate version 12")
    assert not like("common.activate-version", version=1).fullmatch("Activate version 12")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.relative_to(STATIC).as_posix())
def test_no_text_stands_outside_the_catalogue(script):
    found = [*texts_outside(script.read_text(encoding="utf-8"))]
    assert not found, f"move them to {WORDS.relative_to(ROOT)}: {found}"


@pytest.mark.parametrize(
    "source",
    [
        "html`<p>Saved</p>`",
        "html`<p>${n} points</p>`",
        "html`<p>${isOn ? 'on' : 'off'}</p>`",
        "html`<b title='x' aria-label='Save it'/>`",
        "html`<${Fold} title=${isOn ? 'Lines' : t('a.b')} />`",
        "notify({ text: `No ${n}`, fix: '' })",
        "const a = 'Some words';",
        "html`<i class='big red'>${' and more'}</i>`",
        "({ label: 'save' })",
        "const state = { ok: 'Good' };",
        "html`<p>${list.map((x) => html`<b>${x}</b> of them`)}</p>`",
        "html`<p>${t('a.b', { c: isOn ? 'Yes, it is' : '' })}</p>`",
    ],
)
def test_a_text_in_the_code_is_noticed(source):
    assert [*texts_outside(source)]


@pytest.mark.parametrize(
    "source",
    [
        "html`<p class='a b'>${t('a.b')} mm</p>`",
        "html`<p class=${isOn ? 'warning line' : 'line'}>${n} mm</p>`",
        "throw new Error('Nobody sees this.');",
        "// Some words",
        "html`<a href='#/system/jobs'>${number(x)}</a>`",
        "if (event.key === 'Escape') run('save');",
        "import { x } from './some words.js';",
        "html`<b data-x=${a === 'some words'} />`",
    ],
)
def test_what_is_no_text_passes(source):
    assert not [*texts_outside(source)]


def test_every_kind_of_job_has_its_name_on_the_page():
    started = re.compile(
        r'(?:jobs\.start|finished_or_queued)\(\s*(?:request,\s*services,\s*)?"([a-z-]+)"'
    )
    kinds = {
        kind
        for path in PACKAGE.rglob("*.py")
        if "routes" in str(path)
        for kind in started.findall(path.read_text())
    }
    names = "".join(path.read_text() for path in (STATIC / "features").glob("*/index.js"))
    assert {"auto", "rig-check"} <= kinds
    assert {
        kind for kind in kinds if not re.search(rf'\bjobs: {{[^}}]*"?\b{kind}"?: t\(', names)
    } == set()
