// Rate-limited requests: one in flight, the latest one waiting, everything between dropped; and which of several
// answers is the latest.

/**
 * @template T
 * @param {(value: T) => Promise<void>} send
 * @param {number} [patienceMs] how long the latest waits for an earlier answer; then answers may come in another order
 * @returns {(value: T) => Promise<void>} resolves when nothing waits any more
 */
export function latestWins(send, patienceMs) {
  /** @type {{ value: T } | null} */
  let waiting = null;
  /** @type {Promise<void> | null} */
  let running = null;

  async function drain() {
    try {
      while (waiting) {
        const { value } = waiting;
        waiting = null;
        await (patienceMs === undefined
          ? send(value)
          : Promise.race([send(value), pause(patienceMs)]));
      }
    } finally {
      running = null;
    } // at once: what comes now begins anew
  }

  return (value) => {
    waiting = { value };
    running ??= drain();
    return running;
  };
}

/**
 * Questions whose answers may come in another order. begin(): a new one; since(): none, but whoever asks wants to know
 * of a new one.
 * Both give a function that says whether no question has begun meanwhile.
 */
export function requestOrder() {
  let last = 0;
  const since = () => {
    const mine = last;
    return () => mine === last;
  };
  return {
    since,
    begin: () => {
      last += 1;
      return since();
    },
  };
}

/** @param {number} ms */
export const pause = (ms) => new Promise((done) => setTimeout(done, ms));
