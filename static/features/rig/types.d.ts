// The shapes of rigs: what the server says of them, and what the operator makes.

export type { RigJson as Rig, RigPair as Pair, RigReport as RigCheck, StitchedView as Stitched } from "../../core/rest";

/** A rig that is being made. */
export interface Draft { name: string; title: string; field: string; cameras: { camera: string; region: string | null }[] }
