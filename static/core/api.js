// The one way to the server: JSON in and out, refusals as Problem, a silent server as Away.
import { signal } from "@preact/signals";
import { headerName, operatorName } from "./operator.js";
import { translated } from "./statements.js";
import { t } from "./words.js";

const ROOT = "/api/v1";
const RETRY_MS = 2000;

/** Whether the server answered last time. */
export const online = signal(true);
/** The request that was answered last, as errors name it: what was said of its failure is no longer so. */
export const answered = signal({ about: "" });
/** What a silent server's errors are about. */
export const SILENT = "server";

/** A refusal: what was wrong and what to do, as the server says it (RFC 9457 with `fix`). */
export class Problem extends Error {
  /** @param {number} status @param {Record<string, any>} body */
  constructor(status, body) {
    super(body.detail || body.title || t("core.api.answered", { status }));
    this.status = status;
    /** The request, where it is one. */
    this.about = /** @type {string | undefined} */ (undefined);
    this.detail = this.message;
    /** @type {string} */
    this.fix = body.fix || "";
    this.body = body;
  }
}

/** The server did not answer at all. */
export class ServerUnreachable extends Error {
  about = SILENT;
}

/**
 * @param {string} method @param {string} path
 * @param {{ json?: unknown, body?: BodyInit, headers?: Record<string, string>, keepalive?: boolean, stop?: AbortSignal
 * }} [send] keepalive: even when the page is left
 * @returns {Promise<Response>}
 */
export async function request(
  method,
  path,
  { json, body, headers = {}, keepalive = false, stop } = {},
) {
  if (json !== undefined) {
    body = JSON.stringify(json);
    headers = { ...headers, "Content-Type": "application/json" };
  }
  const options = {
    method,
    body,
    keepalive,
    signal: stop,
    headers: {
      Accept: "application/json",
      ...(operatorName.value ? { "X-Operator": headerName() } : {}),
      ...headers,
    },
  };
  let response;
  try {
    response = await fetch(ROOT + path, options);
  } catch (error) {
    if (stop?.aborted) throw error;
    noticeUnreachable();
    throw new ServerUnreachable(t("common.server-silent"));
  }
  online.value = true;
  const parsed = response.json.bind(response);
  response.json = async () => translated(await parsed());
  const about = `${method} ${path.split("?")[0]}`;
  if (response.ok) {
    answered.value = { about };
    return response;
  }
  throw Object.assign(new Problem(response.status, await response.json().catch(() => ({}))), {
    about,
  });
}

/**
 * @param {string} method @param {string} path @param {unknown} [json]
 * @returns {Promise<any>} the answer's JSON
 */
export async function call(method, path, json) {
  const response = await request(method, path, { json });
  return response.status === 204 ? null : response.json();
}

/**
 * Change or delete what still is as the operator saw it; a Problem where somebody else has changed it since.
 * @param {string} method @param {string} path
 * @param {(now: any) => boolean} isSeen whether the server's state of it is the one on show
 * @param {unknown} [json]
 */
export async function changeSeen(method, path, isSeen, json) {
  const found = await request("GET", path);
  if (!isSeen(await found.json()))
    throw new Problem(412, {
      detail: t("core.api.changed-since"),
      fix: t("core.api.changed-since.fix"),
    });
  const etag = found.headers.get("ETag");
  await request(method, path, { json, headers: etag ? { "If-Match": etag } : {} });
}

/**
 * What the server refused, to be shown; any other error goes on.
 * @param {unknown} error
 * @returns {import("./types").Refusal}
 */
export function toRefusal(error) {
  if (error instanceof Problem) {
    const { title, type = "", feature = null, index = null, entry, entries, lenses } = error.body;
    return {
      detail: error.detail,
      fix: error.fix,
      title,
      reason: type.split("/").at(-1),
      feature,
      index,
      entry,
      entries,
      lenses,
    };
  }
  throw error;
}

/** @param {string} path an address for an <img> or a link */
export const address = (path) => ROOT + path;

const THUMBNAIL_PX = 320;
/** A small picture of a snapshot, for lists. @param {string} id */
export const thumbnail = (id) => address(`/snapshots/${id}/image.jpg?width=${THUMBNAIL_PX}`);

function noticeUnreachable() {
  if (!online.value) return;
  online.value = false;
  const again = setInterval(async () => {
    try {
      await fetch(ROOT + "/health");
      online.value = true;
    } catch {
      /* still away */
    }
    if (online.value) clearInterval(again);
  }, RETRY_MS);
}
