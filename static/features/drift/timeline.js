// The time line of a camera's displacement: entries and events in one row each, and which of them are worth a stop.

/**
 * @typedef {import("../../core/types").DriftEntry} Entry
 * @typedef {import("../../core/types").Happening} Happening
 * @typedef {{ at: number, entry: number, mm: number | null, events: Happening[], isStop: boolean }} Row at: unix, s;
 * entry: when its entry begins; mm: null where nothing was measured; isStop: keys go there, and the table has it
 */

const STOP_S = 900; // of each quarter of an hour, the largest displacement is a stop
const MIN_SPAN_S = 600; // on the axis

/**
 * Entries with the events that happened within them, oldest first; the earlier events are of before the history.
 * @param {Entry[]} history
 * @param {Happening[]} events
 * @param {number} entryS
 * @returns {Row[]}
 */
export function rowsOf(history, events, entryS) {
  const seconds = events
    .map((event) => ({ event, at: Date.parse(event.at) / 1000 }))
    .toSorted((a, b) => a.at - b.at);
  const all = history.map(({ at, mm }) => {
    const within = seconds.filter((one) => one.at >= at && one.at < at + entryS);
    return {
      at: within[0]?.at ?? at,
      entry: at,
      mm,
      events: within.map((one) => one.event),
      isStop: within.length > 0,
    };
  });
  const stops = new Map();
  for (const row of all) {
    const quarter = Math.floor(row.at / STOP_S),
      before = stops.get(quarter);
    if (row.mm !== null && (!before || row.mm > before.mm)) stops.set(quarter, row);
  }
  for (const row of [...stops.values(), ...all.slice(-1)]) row.isStop = true;
  return all;
}

/** The row with the largest displacement; null where none was measured. @param {Row[]} rows */
export const largestOf = (rows) =>
  rows.reduce(
    (/** @type {Row | null} */ most, row) =>
      row.mm !== null && row.mm > (most?.mm ?? -1) ? row : most,
    null,
  );

/** The ends of both axes: unix, s, and mm. @param {Row[]} rows @param {number} movedMm @param {number} entryS */
export function axesOf(rows, movedMm, entryS) {
  const end = (rows.at(-1)?.at ?? 0) + entryS,
    most = largestOf(rows)?.mm ?? 0;
  return {
    time: /** @type {[number, number]} */ ([Math.min(rows[0]?.at ?? 0, end - MIN_SPAN_S), end]),
    mm: /** @type {[number, number]} */ ([0, 1.2 * Math.max(1.5 * movedMm, most)]),
  };
}
