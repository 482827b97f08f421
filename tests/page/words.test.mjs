// The page's words: which language it speaks, its messages with their values, and its names of what operators named.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./window.mjs";
import { message, nameOr, t } from "../../static/core/words.js";

let visits = 0;
/** The words as they are loaded in a browser of these languages, in which one was chosen or not. */
async function loaded(languages, chosen = "") {
  navigator.languages = languages;
  localStorage.setItem("touchline-language", chosen);
  visits += 1;
  return import(`../../static/core/words.js?visit=${visits}`);
}

test("a message has the form that the count asks for, and its values in their places", () => {
  assert.deepEqual(
    [0, 1, 2].map((count) => t("common.points", { count })),
    ["0 points", "1 point", "2 points"],
  );
  assert.equal(t("core.format.seconds-ago", { seconds: 7 }), "7 s ago");
  assert.equal(message("core.format.seconds-ago", {}), "{seconds} s ago");
  assert.throws(() => t("no.such-message"), /no\.such-message/);
});

test("what the program names has a name in words, and what an operator named is left as it is", () => {
  assert.equal(nameOr("markings.halfway-line", "otherwise"), "halfway line");
  assert.equal(nameOr("markings.my-line", "my line"), "my line");
  assert.equal(nameOr("markings.toString", "otherwise"), "otherwise");
});

test("the language is the first of the browser's that has a catalogue, and English where none has", async () => {
  for (const [languages, language, locale] of [
    [["fr-FR"], "en", "en-GB"],
    [["fr", "de-AT", "en"], "de", "de"],
    [["en-US", "de"], "en", "en-GB"],
    [[], "en", "en-GB"],
  ]) {
    const words = await loaded(languages);
    assert.deepEqual(
      [words.language, words.LOCALE, document.documentElement.lang],
      [language, locale, locale],
    );
  }
});

test("the language that was chosen goes before the browser's, one that there is no more does not", async () => {
  const german = await loaded(["en-GB"], "de");
  assert.deepEqual(
    [german.language, german.POINT, german.t("common.points", { count: 2 })],
    ["de", ",", "2 Punkte"],
  );
  assert.equal(german.hasStatements, true);
  assert.equal((await loaded(["de"], "xx")).language, "de");
});

test("English has no words for what the server states: its own sentences are English", async () => {
  const english = await loaded(["en-GB"]);
  assert.deepEqual([english.hasStatements, english.statement("anything")], [false, undefined]);
});
