// A line on which the server tells what happens, opened again whenever it breaks, until it is hung up.
import { address } from "./api.js";

const AGAIN_MS = 1500;
const nothing = () => {};

/** @typedef {{ say: (wish: unknown) => void, hangUp: () => void }} Line say(): what is said while the line is down is lost */

/**
 * Nothing is heard any more once it is hung up, not even what was on its way.
 * @param {string} path a WebSocket of the API
 * @param {{ told: (heard: any) => void, opened?: () => void, broken?: () => void }} hear told: of each message; opened: each time the line stands; broken: each time it does no more
 * @returns {Line}
 */
export function openSocket(path, { told, opened = nothing, broken = nothing }) {
  let timer = 0, isOver = false;
  /** @type {WebSocket} */
  let socket;
  function open() {
    socket = new WebSocket(address(path));
    socket.addEventListener("open", () => { if (!isOver) opened(); });
    socket.addEventListener("message", ({ data }) => { if (!isOver) told(JSON.parse(data)); });
    socket.addEventListener("close", () => {
      if (isOver) return;
      broken();
      timer = setTimeout(open, AGAIN_MS);
    });
  }
  open();
  return {
    say: (wish) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(wish)); },
    hangUp: () => { isOver = true; clearTimeout(timer); socket.close(); },
  };
}
