// Messages of WS /cameras/{id}/board.
/** What the server sees of a board before a live camera. quad: its outermost corners; wanted: the next view, null: enough. */
export interface BoardView {
  seq: number; width: number; height: number; corners: [number, number][]; quad: [number, number][] | null; still: boolean; new: boolean; hint: string;
  automatic: boolean; count: number; cells: number[][]; share: number; tilts: Record<string, number>;
  wanted: { text: string; outline: [number, number][]; nearer: string; tilt_deg: number } | null; taken: { id: string } | null;
}
