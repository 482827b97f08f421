// Requests at the rate of a pointer: one under way, the latest one waiting; and which of several answers counts.
import assert from "node:assert/strict";
import { test } from "node:test";
import { latestWins, pause, requestOrder } from "../../static/core/latest_wins.js";

/** A request that is answered when the test says so. */
function held() {
  const asked = [],
    answers = [];
  const ask = latestWins((value) => {
    asked.push(value);
    return new Promise((resolve, reject) => {
      answers.push({ resolve, reject });
    });
  });
  const turn = () =>
    new Promise((resolve) => {
      setImmediate(resolve);
    });
  return { ask, asked, answers, turn };
}

test("while one is under way only the latest waits, and all are told when nothing waits any more", async () => {
  const { ask, asked, answers, turn } = held();
  const all = Promise.all([1, 2, 3, 4].map(ask));
  await turn();
  assert.deepEqual(asked, [1]);
  answers[0].resolve();
  await turn();
  assert.deepEqual(asked, [1, 4]);
  answers[1].resolve();
  await all;
  assert.deepEqual(asked, [1, 4]);
});

test("a request that fails is told, and the next one is asked", async () => {
  const { ask, asked, answers } = held();
  const first = ask(1);
  answers[0].reject(new Error("refused"));
  await assert.rejects(first, /refused/);
  const second = ask(2);
  answers[1].resolve();
  await second;
  assert.deepEqual(asked, [1, 2]);
});

test("an answer counts as long as no other question has begun", () => {
  const order = requestOrder();
  const first = order.begin(),
    beside = order.since();
  assert.deepEqual([first(), beside()], [true, true]);
  const second = order.begin();
  assert.deepEqual([first(), beside(), second()], [false, false, true]);
});

test("with patience the latest is asked although an earlier answer is still to come, and each only once", async () => {
  const asked = [],
    answers = [];
  const ask = latestWins((value) => {
    asked.push(value);
    return new Promise((resolve) => {
      answers.push(resolve);
    });
  }, 1);
  const asking = Promise.all([1, 2, 3].map(ask));
  while (asked.length < 2) await pause(1);
  await asking;
  assert.deepEqual(asked, [1, 3]);
  answers.forEach((answer) => answer());
  const more = ask(4);
  answers[2]();
  await more;
  assert.deepEqual(asked, [1, 3, 4]);
});
