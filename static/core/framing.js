// Messages of JSON and bytes, as the server frames them: a little-endian uint32 length, so much JSON, the rest.

/** @param {ArrayBuffer} message @returns {{ head: any, payload: Uint8Array }} */
export function parts(message) {
  const length = new DataView(message).getUint32(0, true);
  return {
    head: JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length))),
    payload: new Uint8Array(message, 4 + length),
  };
}
