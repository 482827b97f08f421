// One request in flight, the newest one waiting, everything between forgotten: for answers at pointer rate.

/**
 * @template T
 * @param {(value: T) => Promise<void>} send
 * @returns {(value: T) => Promise<void>} resolves when nothing waits any more
 */
export function newestWins(send) {
  /** @type {{ value: T } | null} */
  let waiting = null;
  /** @type {Promise<void> | null} */
  let running = null;

  async function drain() {
    try {
      while (waiting) {
        const { value } = waiting;
        waiting = null;
        await send(value);
      }
    } finally { running = null; } // at once: what comes now begins anew
  }

  return (value) => {
    waiting = { value };
    running ??= drain();
    return running;
  };
}
