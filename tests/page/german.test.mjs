// The page in German: its numbers, and what the server states in codes and values.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./window.mjs";

localStorage.setItem("touchline-language", "de");
const { dayAndTime, inSentence, lineTitle, number } = await import("../../static/core/format.js");
const { inWords, translated } = await import("../../static/core/statements.js");
const { statements } = await import("../../static/core/words/de.js");

const all = Object.entries(statements);
const [PLAIN] = all.find(([, text]) => !text.includes("{"));
const [VALUED, TEMPLATE] = all.find(([, text]) => /^[^{]*\{\w+\}[^{]*$/.test(text));
const [, NAME] = /\{(\w+)\}/.exec(TEMPLATE);
const said = (value) => inWords({ code: VALUED, values: { [NAME]: value } });
const want = (text) => TEMPLATE.replace(`{${NAME}}`, text);

test("numbers have a comma, dates and nouns are German", () => {
  assert.equal(number(-1234.5), "−1\u202f234,5");
  assert.equal(dayAndTime("2026-11-27T06:46:00Z"), "27. Nov., 06:46");
  assert.deepEqual(
    [lineTitle("halfway-line"), inSentence("Mittellinie")],
    ["Mittellinie", "Mittellinie"],
  );
});

test("a statement has its values in their places: measures with a comma, other texts as they are", () => {
  assert.deepEqual(
    [said("2.5 mm"), said("-3.25"), said("lens.v2.json")],
    ["2,5 mm", "−3,25", "lens.v2.json"].map(want),
  );
  assert.equal(said(["1.5 px", "2.5 px"]), want("1,5 px, 2,5 px"));
  assert.equal(said({ code: "line.halfway-line" }), want("Mittellinie"));
  assert.equal(said({ text: "Hall 2.1" }), want("Hall 2.1"));
});

test("a statement that German has no words for stays as the server said it", () => {
  const no = { code: "no.such-statement" };
  assert.deepEqual(
    [inWords(no), said(no), inWords({ code: "toString" })],
    [undefined, undefined, undefined],
  );
  const answer = { text: "English.", statements: { text: [{ code: PLAIN }, no] } };
  assert.equal(translated(answer).text, "English.");
});

test("a name before a sentence stays as it is, and the sentence is German", () => {
  const answer = translated({
    text: "North: English.",
    statements: { text: [{ text: "North:" }, { code: PLAIN }] },
  });
  assert.equal(answer.text, `North: ${statements[PLAIN]}`);
});

test("sentences of an answer are translated wherever they stand, a list one for each", () => {
  const words = statements[PLAIN];
  const answer = translated({
    text: "English.",
    statements: { text: [{ code: PLAIN }, { code: PLAIN }] },
    numbers: [1, 2],
    inner: [
      { said: ["One.", "Two."], statements: { said: [{ code: "no.such" }, { code: PLAIN }] } },
    ],
  });
  assert.equal(answer.text, `${words} ${words}`);
  assert.deepEqual(answer.inner[0].said, ["One.", words]);
  assert.deepEqual(answer.numbers, [1, 2]);
});
