/* The story of a generated client: upload, find the calibration, wait, transform, export. Types: openapi-typescript. */
import { readFile } from "node:fs/promises";
import createClient from "openapi-fetch";
import type { components, paths } from "./rest";

type Job = components["schemas"]["Job"];

const [url, token, image] = process.argv.slice(2) as [string, string, string];
const client = createClient<paths>({ baseUrl: url, headers: { Authorization: `Bearer ${token}` } });

/** What the server answered; its problem, with the fix, as an error. */
function made<T>(answer: { data?: T; error?: components["schemas"]["Problem"] }): T {
  if (answer.error) throw new Error(`${answer.error.detail} ${answer.error.fix}`);
  return answer.data as T;
}

/** A job when it has ended. */
async function ended(job: Job): Promise<Job> {
  while (job.state === "queued" || job.state === "running") {
    await new Promise((resume) => setTimeout(resume, 100));
    job = made(await client.GET("/api/v1/jobs/{id}", { params: { path: { id: job.id } } }));
  }
  return job;
}

const form = new FormData();
form.append("file", new Blob([await readFile(image)]), "field.png");
const snapshot = made(await client.POST("/api/v1/snapshots", { body: form as never }));
const job = await ended(made(await client.POST("/api/v1/calibrations/auto", {
  body: { snapshot: snapshot.id, field: "ssl-div-b", region: "full" },
})));
const { calibration: id } = job.result as { calibration: string };
const { points } = made(await client.POST("/api/v1/calibrations/{id}/transform", {
  params: { path: { id } },
  body: { from: "image", to: "field", points: [[320, 240], [-90000, 0]] },
})) as components["schemas"]["Transformed"]; // binary points are answered in kind
const exported = made(await client.GET("/api/v1/calibrations/{id}/export/{format}", {
  params: { path: { id, format: "opencv" } },
  parseAs: "text",
}));
const corrected = made(await client.GET("/api/v1/calibrations/{id}/corrected.{format}", {
  params: { path: { id, format: "png" }, query: { width: 320 } },
  parseAs: "arrayBuffer",
}));
const refusal = await client.GET("/api/v1/calibrations/{id}", { params: { path: { id: "none" } } });
console.log(JSON.stringify({ points, exported, png: corrected.byteLength, fix: refusal.error?.fix }));
