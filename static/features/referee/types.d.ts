// GET /referee.
export type Team = "blue" | "yellow";
/** One team's robots. source: where name or height is from; null where
 * nothing was entered or heard. known: the height is not merely the field's. */
export interface TeamHeight { team: string | null; entry: string | null; height_mm: number | null; source: "hand" | "game-controller" | null; known: boolean }
export interface TeamByHand { name: string | null; height_mm: number | null }
export interface Controller {
  id: string; address: string; port: number; age_s: number; packets: number; refused: number; refusal: string | null; current: boolean; chosen: boolean;
  stage: string | null; command: string | null; blue: string | null; yellow: string | null;
}
export interface Referee {
  enabled: boolean | null; group: string; port: number; interface: string; blue: TeamByHand; yellow: TeamByHand; heights: Record<string, number>;
  listening: boolean; problem: import("../league/types").Trouble | null; teams: Record<Team, TeamHeight>; controllers: Controller[];
  table: { team: string; height_mm: number; own: boolean }[]; interfaces: { name: string; address: string | null }[];
}
