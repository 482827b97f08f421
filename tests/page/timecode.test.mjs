// The timecode that a simulated camera paints into its picture: read at any width, and refused where it is not whole.
import assert from "node:assert/strict";
import { test } from "node:test";
import { readTimecode, rows } from "../bench/latency/timecode.js";

const WHEN = Date.UTC(2026, 10, 27, 22, 45, 12, 345);

/** CRC-8 of the six bytes of a time, polynomial 0x07. */
function checksum(when) {
  let crc = 0;
  for (let i = 5; i >= 0; i--) {
    crc ^= Math.floor(when / 2 ** (8 * i)) % 256;
    for (let bit = 0; bit < 8; bit++) crc = crc & 0x80 ? ((crc << 1) ^ 0x07) & 0xff : crc << 1;
  }
  return crc;
}

/** The strip of a picture in which a time is painted; of: its 64 bits as they are to be painted. */
function painted(width, when, { of = (bits) => bits, white = 230, black = 20 } = {}) {
  const digits = (value, count) => [...value.toString(2).padStart(count, "0")].map(Number);
  const bits = of([1, 0, 1, 0, ...digits(when, 48), ...digits(checksum(when), 8), 0, 1, 0, 1]),
    { height } = rows(width),
    cell = width / 96,
    data = new Uint8ClampedArray(4 * width * height).fill(90);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) {
      const bit = bits[Math.floor(x / cell - 1)]; // the first cell is left free
      if (bit !== undefined)
        data.fill(bit ? white : black, 4 * (y * width + x), 4 * (y * width + x) + 3);
    }
  return { data, width, height };
}

test("a time is read at any width of the picture", () => {
  for (const width of [320, 480, 640, 1000, 1920])
    assert.equal(readTimecode(painted(width, WHEN)), WHEN);
  assert.equal(readTimecode(painted(640, 0)), 0);
});

test("a bit that was read wrong is noticed, wherever it is", () => {
  for (const wrong of [0, 3, 4, 30, 51, 52, 59, 60, 63]) {
    const of = (bits) => bits.map((bit, i) => (i === wrong ? 1 - bit : bit));
    assert.equal(readTimecode(painted(640, WHEN, { of })), null, `bit ${wrong}`);
  }
});

test("where nothing is painted, or hardly, there is no time", () => {
  assert.equal(readTimecode(painted(640, WHEN, { white: 100, black: 60 })), null);
  assert.equal(readTimecode(painted(640, WHEN, { of: () => [] })), null);
});
