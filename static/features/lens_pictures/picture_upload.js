// Pictures that are uploaded and listed for work on a lens: views of a board, pictures of straight edges.
import { computed, signal } from "@preact/signals";
import { call, request } from "../../core/api.js";
import { notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";

const AT_ONCE = 2; // uploads

/** @typedef {import("../../core/types").UploadedPicture} UploadedPicture */

/**
 * A desk's pictures.
 * @param {UploadedPicture[]} before
 * @param {"board" | "straight"} purpose
 * @param {() => void} changed keeps the list over a reload
 */
export function pictureList(before, purpose, changed) {
  const pictures = signal(before);
  const uploading = computed(() =>
    pictures.value.some((p) => p.state === "waiting" || p.state === "uploading"),
  );
  const ready = computed(() => pictures.value.filter((p) => p.state === "kept"));
  /** @param {UploadedPicture[]} next */
  const set = (next) => {
    pictures.value = next;
    changed();
  };
  /** @param {string} key @param {Partial<UploadedPicture>} changes */
  const mark = (key, changes) =>
    set(pictures.value.map((p) => (p.key === key ? { ...p, ...changes } : p)));

  /** @param {string} key @param {File} file */
  async function send(key, file) {
    if (!pictures.value.some((p) => p.key === key)) return; // removed while it waited
    mark(key, { state: "uploading" });
    const body = new FormData();
    body.append("file", file, file.name);
    body.append("purpose", purpose);
    try {
      mark(key, {
        state: "kept",
        id: (await (await request("POST", "/snapshots", { body })).json()).id,
      });
    } catch (error) {
      const { message, fix = "" } = /** @type {{ message: string, fix?: string }} */ (error);
      mark(key, { state: "refused", why: `${message} ${fix}` });
    }
  }

  return {
    pictures,
    uploading,
    ready,
    /** Upload pictures, a few at a time. @param {Iterable<File>} files */
    async add(files) {
      const waiting = [...files].map((file) => ({
        file,
        key: `${file.name}-${crypto.getRandomValues(new Uint32Array(1))[0]}`,
      }));
      pictures.value = [
        ...pictures.value,
        ...waiting.map(
          ({ file, key }) =>
            /** @type {UploadedPicture} */ ({
              key,
              name: file.name,
              state: "waiting",
              id: "",
              why: "",
            }),
        ),
      ];
      const upload = async () => {
        for (let next = waiting.shift(); next; next = waiting.shift())
          await send(next.key, next.file);
      };
      await Promise.all(Array.from({ length: AT_ONCE }, upload));
    },
    /** One more, from a camera. @param {string} camera */
    async take(camera) {
      try {
        const { id } = await call("POST", "/snapshots", { camera, purpose });
        set([
          ...pictures.value,
          {
            key: id,
            name: t("lens-pictures.picture-name", { number: pictures.value.length + 1 }),
            state: "kept",
            id,
            why: "",
          },
        ]);
      } catch (error) {
        notifyError(error);
      }
    },
    /** One that the server has already. @param {UploadedPicture} picture */
    keep: (picture) => set([...pictures.value, picture]),
    /** @param {string} key */
    remove: (key) => set(pictures.value.filter((p) => p.key !== key)),
    clear: () => set([]),
  };
}
