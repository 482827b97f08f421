// How a WebSocket is left.

/**
 * Close it; one that is still being opened, once it is. Given up before that, it counts as failed, and Firefox lets
 * every next one to the same server wait longer, up to a minute.
 * @param {WebSocket | null} socket
 */
export function leave(socket) {
  if (socket?.readyState === WebSocket.CONNECTING)
    socket.addEventListener("open", () => socket.close());
  else socket?.close();
}
