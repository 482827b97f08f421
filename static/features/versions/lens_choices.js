// What each of two lenses makes of a camera's image, for a file that does not state which of them it means.
import { call, request } from "../../core/api.js";

const WIDTH_PX = 320; // of each picture

/** @typedef {import("../../core/types").LensReading} LensReading */

/** A camera's newest picture. @param {string} camera @returns {Promise<import("../../core/types").Snapshot | null>} */
export async function newestPicture(camera) {
  if (!camera) return null;
  const of = encodeURIComponent(camera);
  return (await call("GET", `/snapshots?camera=${of}&purpose=picture&limit=1`)).items[0] ?? null;
}

/**
 * The camera's newest picture corrected with each lens, else its live picture, else squares as each lens shows them.
 * @param {LensReading[]} lenses @param {string} camera "" for none
 * @returns {Promise<{ urls: string[], isDrawn: boolean }>}
 */
export async function lensPictures(lenses, camera) {
  for (const image of await imagesOf(camera, lenses[0].lens.image_size))
    try {
      return { urls: await Promise.all(lenses.map((it) => pictureUrl(it, image))), isDrawn: false };
    } catch {
      /* of another shape, or the camera is offline: the next one */
    }
  return { urls: await Promise.all(lenses.map((it) => pictureUrl(it, {}))), isDrawn: true };
}

/** @param {string} camera @param {{ width: number, height: number }} size */
async function imagesOf(camera, { width, height }) {
  if (!camera) return [];
  const picture = await newestPicture(camera).catch(() => null),
    isAlike = picture && picture.width * height === picture.height * width;
  return [...(isAlike ? [{ snapshot: picture.id }] : []), { camera }];
}

/** @param {LensReading} reading @param {{ snapshot?: string, camera?: string }} image */
async function pictureUrl({ lens }, image) {
  const path = `/lenses/picture.jpg?width=${WIDTH_PX}`,
    answer = await request("POST", path, { json: { ...image, lens } });
  return URL.createObjectURL(await answer.blob());
}
