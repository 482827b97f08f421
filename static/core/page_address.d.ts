// The address of a page beside the six steps.
/** One page: its name in the address, and what follows it there. */
export interface PageAddress { name: "jobs" | "settings" | "versions" | "capture" | "rig" | "rolls" | "scene" | "seeing"; argument: string }
