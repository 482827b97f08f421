// GET /publishing and GET /publishing/heard.
export interface Trouble { reason: string; what: string; fix: string }
export interface Loss { rms_mm: number; worst_mm: number; worst_place: [number, number]; hat_rms_mm: number | null; hat_worst_mm: number | null; hat_height_mm: number }
/** One camera as it is sent, or why not. */
export interface PublishedCamera {
  camera: string; calibration: string; version: number; model: string; field: string; region: string; camera_id: number; published: boolean; exact: boolean;
  loss: Loss | null; expected: ExpectedError | null; fit_expected: ExpectedError | null; level: "good" | "fair" | "poor" | null; warnings: Notice[];
  problem: Trouble | null;
}
/** mm rms; known: false where an error at robot tops is a guess. */
export interface ExpectedError { rms: number; rms_95: number; z_mm: number; known?: boolean; hat?: ExpectedError }
export interface Notice { reason: string; text: string; fix: string }
/** GET /calibrations/{id}/packet. */
export interface Packet {
  calibration: string; exact: boolean; loss: Loss | null; expected: ExpectedError | null; fit_expected: ExpectedError | null;
  level: "good" | "fair" | "poor" | null; asked: boolean; warnings: Notice[]; problem: Trouble | null;
}
/** By the packet's names; null: that part is not sent. */
export interface BallModels {
  straight_two_phase: { [name: string]: number } | null; chip_fixed_loss: { [name: string]: number } | null;
}
/** GET /publishing. */
export interface Publishing {
  enabled: boolean; absorb: boolean; group: string; port: number; interface: string; ttl: number; interval_s: number; limit_mm: number; pass_on: boolean;
  broadcast: boolean; rig: string; members: string[]; rigs: { name: string; title: string; separate: boolean }[];
  listen_first_s: number; ball_models: BallModels | null;
  passed_on: { address: string; source: string; heard_at: number; models: boolean; cameras: number[] } | null;
  state: "off" | "starting" | "asking" | "on-air" | "silent" | "failing"; problem: Trouble | null;
  said: { packets: number; bytes: number; age_s: number | null; failures: number } | null;
  cameras: PublishedCamera[]; interfaces: { name: string; address: string | null }[];
}
export interface ReceivedCamera {
  camera_id: number; image_size: [number, number] | null; position_mm: [number, number, number] | null; focal_px: number; distortion: number;
  problem: Trouble | null; ours: string | null; contradicts: boolean;
}
export interface GeometrySender {
  id: string; address: string; port: number; source: string; age_s: number; packets: number; geometries: number; refused: number; refusal: string | null;
  skipped: number; geometry_age_s: number | null; sha256: string | null; problem: Trouble | null; cameras: ReceivedCamera[]; differs: { text: string }[];
  ball_models: BallModels | null;
  field: { name: string; title: string; length_mm: number; width_mm: number; known: boolean } | null;
}
/** GET /publishing/heard. */
export interface ReceivedGeometry { listening: boolean; problem: Trouble | null; datagrams: number; own: number; items: GeometrySender[] }
