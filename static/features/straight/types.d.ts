// GET /cameras/{id}/rolls and the messages of its WebSocket.
/** One roll as a picture judges it. bow_pct: Eq. (9); spread_pct: its σ. */
export interface JudgedRoll { length_px: number; bow_pct: number; sigma_pct: number; spread_pct: number; rms_px: number; level: string; words: string; used: boolean }
/** A roll that is kept. at: unix, s; counts: whether it is of pictures of the newest one's size. */
export interface SavedRoll { id: string; at: number; seconds: number; left_out: boolean; counts: boolean; points: [number, number][]; raw: JudgedRoll | null; corrected: JudgedRoll | null; etag: string }
export interface SagZone { pct: number; sigma_pct: number; rolls: number }
/** What all rolls say of a picture. */
export interface RollsSummary { border_pct: number | null; border_sigma_pct: number | null; free: boolean; sentence: string; zones: (SagZone | null)[][] }
/** m/s², and the share of the first speed. */
export interface MeasuredValue { value: number; sigma: number; rolls: number }
export interface Deceleration { acc_roll: MeasuredValue | null; acc_slide: MeasuredValue | null; k_switch: MeasuredValue | null; sentence: string }
export interface RollsResponse { camera: string; etag: string; deceleration: Deceleration | null; items: SavedRoll[]; report: { raw: RollsSummary; corrected: RollsSummary | null; sentence: string } | null }
/** What moves now, and the ids of rolls that have just ended. */
export interface MovingTracks { seq: number; width: number; height: number; tracks: [number, number][][]; hint: string; new: string[] }
