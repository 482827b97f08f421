// The address bar: written when the page goes elsewhere and followed when it changes, so that a reload or a second tab
// goes on where this one is.
import { effect, signal } from "@preact/signals";

/** Whether the address leads somewhere that is not there yet: until then nothing else is shown in its place. */
export const opening = signal(location.hash.length > "#/".length);

/** Write the address from now on, and follow it once the page's lists are there. Returns when the first picture is.
 * @param {Promise<void>} lists @param {{ here: { value: string }, follow: () => Promise<void> }} routes the address of
 * where the page is, and the way to the address in the bar */
export async function startRouter(lists, { here, follow }) {
  let following = false; // the address is read: until all is there it is not written
  effect(() => {
    const wanted = here.value,
      isOpening = opening.value,
      isNowhere = wanted === "#/" && (isOpening || !location.hash);
    if (following || isNowhere || location.hash === wanted) return;
    history.pushState(null, "", wanted);
  });
  addEventListener("hashchange", () => void lists.then(follow));
  await lists;
  // Somebody may have opened a picture, or gone to the board, before we came so far: that, then, not the address.
  if (opening.value && here.value === "#/") {
    following = true;
    await follow();
    following = false;
  }
  opening.value = false;
}
