// The levels of a verdict in words.
export const LEVEL = { good: "Good", fair: "Fair", poor: "Poor", unknown: "Not known inside" };
