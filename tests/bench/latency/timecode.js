// Reads the timecode that a simulated camera paints into its picture: 64 cells, scaled by the picture's width.
const ACROSS = 96,
  COUNT = 64,
  BITS = 48,
  CONTRAST = 60;
const MARKS = /** @type {[number, number][]} */ ([
  [0, 1],
  [1, 0],
  [2, 1],
  [3, 0],
  [60, 0],
  [61, 1],
  [62, 0],
  [63, 1],
]);

/** The rows of the picture that hold the code. @param {number} width */
export function rows(width) {
  const cell = width / ACROSS,
    top = Math.floor(1.25 * cell);
  return { top, height: Math.ceil(1.75 * cell) - top };
}

/**
 * ms since 1970, or null where none can be read.
 * @param {ImageData} strip the picture's `rows`
 * @returns {number | null}
 */
export function readTimecode({ data, width, height }) {
  const cell = width / ACROSS;
  const level = Array.from({ length: COUNT }, (_, i) => {
    const from = Math.floor((1.25 + i) * cell),
      to = Math.ceil((1.75 + i) * cell);
    let sum = 0;
    for (let y = 0; y < height; y++)
      for (let x = from; x < to; x++)
        sum += data[4 * (y * width + x)] + data[4 * (y * width + x) + 1] + data[4 * (y * width + x) + 2];
    return sum / (3 * height * (to - from));
  });
  const mean = (/** @type {number} */ bit) =>
    MARKS.filter(([, b]) => b === bit).reduce((sum, [i]) => sum + level[i], 0) / 4;
  const white = mean(1),
    black = mean(0);
  if (white - black < CONTRAST) return null;
  const bits = level.map((l) => Number(l > (white + black) / 2));
  const value = bits.slice(4, 4 + BITS).reduce((sum, bit) => 2 * sum + bit, 0);
  const sent = bits.slice(4 + BITS, 60).reduce((sum, bit) => 2 * sum + bit, 0);
  return MARKS.every(([i, bit]) => bits[i] === bit) && sent === crc(bits.slice(4, 4 + BITS)) ? value : null;
}

/** CRC-8 of bits, polynomial 0x07. @param {number[]} bits */
function crc(bits) {
  let found = 0;
  for (const bit of bits) {
    const top = (found >> 7) ^ bit;
    found = (found << 1) & 0xff;
    if (top) found ^= 0x07;
  }
  return found;
}
