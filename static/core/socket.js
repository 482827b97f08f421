// A WebSocket of the API that is opened again whenever it breaks, until it is closed.
import { address } from "./api.js";
import { leave } from "./leave.js";
import { translated } from "./statements.js";

const AGAIN_MS = 1500;
const nothing = () => {};

/**
 * @typedef {{ send: (message: unknown) => void, close: () => void }} Socket send(): a message is lost while the socket
 * is down
 */

/**
 * Open one. No message arrives once it is closed, not even one that was on its way.
 * @param {string} path a WebSocket of the API
 * @param {{ onMessage: (message: any) => void, onOpen?: () => void, onBreak?: () => void }} listeners onOpen: each time
 * it is connected; onBreak: each time it is no longer
 * @returns {Socket}
 */
export function openSocket(path, { onMessage, onOpen = nothing, onBreak = nothing }) {
  let timer = 0,
    isOver = false;
  /** @type {WebSocket} */
  let socket;
  function open() {
    socket = new WebSocket(address(path));
    socket.addEventListener("open", () => {
      if (!isOver) onOpen();
    });
    socket.addEventListener("message", ({ data }) => {
      if (!isOver) onMessage(translated(JSON.parse(data)));
    });
    socket.addEventListener("close", () => {
      if (isOver) return;
      onBreak();
      timer = setTimeout(open, AGAIN_MS);
    });
  }
  open();
  return {
    send: (message) => {
      if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
    },
    close: () => {
      isOver = true;
      clearTimeout(timer);
      leave(socket);
    },
  };
}
