"""The page's language: every text of the page comes from the catalogue of the language that the browser asks for."""

import calendar
import re

import pytest
from playwright.sync_api import expect

from tests.e2e.test_access import PLACES, STEPS, at_rest, cut_off
from tests.support.page_text import UNITS
from touchline.core.field import BORDERS
from touchline.core.sentences import AREAS, MARKINGS

# Before anything else runs: the language, and a list of all that the server says, which is English.
PSEUDO = """localStorage.setItem("touchline-language", "pseudo");
window.heard = [];
const parse = JSON.parse, json = Response.prototype.json;
const hear = (it) => {
  if (typeof it === "string") window.heard.push(it);
  else if (it && typeof it === "object")
    for (const [key, value] of Object.entries(it)) { window.heard.push(key); hear(value); }
  return it; };
JSON.parse = (...given) => hear(parse(...given));
Response.prototype.json = async function () { return hear(await json.call(this)); };"""
# What a reader can see or hear: texts, names, titles. The manual, the key names, code, and the name that the browser
# gives its graphics speak for themselves.
SHOWN = """() => { const found = [];
  for (const it of document.querySelectorAll("#app *")) {
    if (it.closest("script, style, noscript, .manual, kbd, code, pre, [data-testid=correction-now]")) continue;
    for (const name of ["aria-label", "title", "placeholder", "alt", "label", "aria-valuetext"])
      if (it.hasAttribute(name)) found.push(it.getAttribute(name));
    for (const node of it.childNodes) if (node.nodeType === 3) found.push(node.data);
  }
  return [...new Set(found)]; }"""
ENGLISH = re.compile(r"[A-Za-z]{2,}(?:[ -][A-Za-z]{2,})*")
ADDRESS = re.compile(r"\w+://.+")  # of a camera: "sim://ssl-div-b (half)"
ID = re.compile(r"[a-z0-9]+(-[a-z0-9]+)+")
# "halfway line" is an id in words, and what the server calls it; so are these ids of claims, and parts of their titles.
SAID = {*MARKINGS.values(), *AREAS.values(), "cameras live", "cameras calibrated"}
# of no catalogue; the browser writes dates
NAMES = UNITS | {"JSON", "PNG", "SSL-Vision", *calendar.month_abbr}


def plain(text: str) -> str:
    return re.sub(r"[-_\s]+", " ", text).lower()


def strangers(page) -> set[str]:
    """What the page shows in English although neither the server nor the operator said it, and ids of the server."""
    shown = page.evaluate(SHOWN)
    heard = page.evaluate("window.heard")  # after it: no text is shown before it was heard
    ids = (
        {plain(it) for it in (*heard, *MARKINGS, *AREAS) if ID.fullmatch(it)} | {*BORDERS, *AREAS}
    ) - SAID
    heard = plain("\n".join(heard))
    return {
        run
        for text in shown
        for run in ENGLISH.findall(ADDRESS.sub("", text))
        if plain(run) in ids or (plain(run) not in heard and not {*run.split()} <= NAMES)
    }


@pytest.fixture
def pseudo(browser):
    """A context in which the page speaks a language that nobody takes for English."""
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    context.add_init_script(PSEUDO)
    yield context
    context.close()


def test_every_text_of_every_page_and_step_comes_from_the_catalogue(
    pseudo, saved, server, access_rig
):
    kept, page, found = saved("brown-conrady"), pseudo.new_page(), {}
    for name, (address, place) in PLACES.items():
        page.goto(f"{server.url}/{address}")
        at_rest(page, place)
        found[name] = strangers(page)
    for step in STEPS:
        page.goto(f"{server.url}/#/calibrate/{kept.snapshot}/{step}")
        expect(page.get_by_test_id(f"step-{step}")).to_have_attribute("aria-current", "step")
        at_rest(page, STEPS[step])
        found[step] = strangers(page)
    page.keyboard.press("F2")
    expect(page.get_by_test_id("tour")).to_be_visible()
    found["tour"] = strangers(page)
    page.get_by_test_id("help").click()
    page.get_by_test_id("help").press("ArrowRight")
    found["help"] = strangers(page)
    assert {name: texts for name, texts in found.items() if texts} == {}


def test_a_choice_is_called_by_its_german_name(browser, server):
    context = browser.new_context(locale="de-DE")
    page = context.new_page()
    page.goto(f"{server.url}/index.html")
    shown = page.evaluate("""async () => {
      const { OptionRow } = await import("/features/calibrate/panels/options.js");
      const { models } = await import("/core/state.js");
      const { html } = await import("/core/html.js");
      const { render } = await import("preact");
      models.value = [{ name: "homography", title: "Homographie" }];
      const room = document.body.appendChild(document.createElement("div"));
      const row = (name, type, choices) => ({ name, type, default: choices[0], choices, help: "", range: null });
      render(html`${[row("method", "choice", ["none", "median"]), row("teams", "names", ["yellow"]),
        row("base", "choice", ["homography"]), row("patches", "choice", ["1"])].map((option) =>
          html`<${OptionRow} option=${option} id=${option.name} value=${option.default} set=${() => {}} />`)}`, room);
      return [...room.querySelectorAll("option, .terms label")].map((it) => it.textContent.trim()); }""")
    context.close()
    assert shown == ["keines", "Median", "Gelb", "Homographie", "1"]


HINTS = """(foot) => {
  // Whichever problems there are, this is about the hints beside them.
  foot.querySelector("[data-testid=status]").style.cssText = "max-width: 9em; overflow: hidden; white-space: nowrap";
  const hints = foot.querySelector(".hints"), bar = foot.getBoundingClientRect();
  const drawn = () => {
    const row = hints.getBoundingClientRect();
    const seen = [...hints.children].map((it) => it.getBoundingClientRect())
      .filter((it) => it.top < row.bottom && it.left < row.right);
    return [seen.length, row.right <= bar.right && seen.every((it) => it.left >= row.left - 1
      && it.right <= row.right + 1 && it.top >= row.top - 1 && it.bottom <= row.bottom + 1)];
  };
  const [count, areWhole] = drawn();
  hints.style.maxWidth = "40px"; // beside a long problem
  const narrow = drawn();
  hints.style.maxWidth = "";
  return [count > 1, areWhole, narrow, foot.scrollWidth <= foot.clientWidth]; }"""


def test_no_hint_of_the_german_status_bar_is_cut(browser, saved, server):
    """As many stand there as find room, and each is whole."""
    kept = saved("brown-conrady")
    context = browser.new_context(locale="de-DE")
    page, found = context.new_page(), {}
    for step in ("points", "verify"):
        page.goto(f"{server.url}/#/calibrate/{kept.snapshot}/{step}")
        expect(page.get_by_test_id(f"step-{step}")).to_have_attribute("aria-current", "step")
        at_rest(page, STEPS[step])
        for width in (1024, 1280, 1600):
            page.set_viewport_size({"width": width, "height": 800})
            found[step, width] = page.locator("footer").evaluate(HINTS)
    context.close()
    assert {
        at: is_so for at, is_so in found.items() if is_so != [True, True, [0, True], True]
    } == {}


# No German text has them; names of fields, models, files and operators have none of them either.
ENGLISH_ONLY = re.compile(
    r"\b(the|of|is|are|were|with|and|from|this|not|no|your?|its?|has|have|been|to|for|by|at|on)\b"
)


def test_a_german_telephone_gets_a_german_page_with_nothing_english_in_it_and_nothing_cut_off(
    browser, saved, server, access_rig
):
    kept, size = saved("brown-conrady"), {"width": 360, "height": 740}
    context = browser.new_context(locale="de-DE", viewport=size, has_touch=True)
    page, found = context.new_page(), {}

    def wrong() -> list[str]:
        english = [
            text
            for text in page.evaluate(SHOWN)
            if ENGLISH_ONLY.search(text) and not text.startswith("/")
        ]  # a path
        return english + cut_off(page, **size)

    for name, (address, place) in PLACES.items():
        page.goto(f"{server.url}/{address}")
        at_rest(page, place)
        found[name] = wrong()
    for step in STEPS:
        page.goto(f"{server.url}/#/calibrate/{kept.snapshot}/{step}")
        at_rest(page, step=step)
        found[step] = wrong()
    assert page.locator("html").get_attribute("lang") == "de"
    context.close()
    assert {name: texts for name, texts in found.items() if texts} == {}


def test_the_language_is_chosen_among_the_preferences_and_kept(page, server):
    page.goto(f"{server.url}/#/system/server")
    page.get_by_test_id("language").select_option("de")
    expect(page.locator("html")).to_have_attribute("lang", "de")
    expect(page.get_by_test_id("language")).to_have_value("de")
    page.reload()
    expect(page.locator("html")).to_have_attribute("lang", "de")
    page.get_by_test_id("language").select_option("")
    expect(page.locator("html")).to_have_attribute("lang", "en-GB")
