// The paper's correction while a border is dragged: its mesh bent to where the points are now.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bentMesh } from "../../static/features/calibrate/live_mesh.js";

// A straight picture of 640 × 480: the region is between x 80 and 560, y 60 and 420, and as large when corrected.
const WIDTH = 480,
  HEIGHT = 360,
  MESH = {
    columns: 5,
    rows: 4,
    first: [0, 0],
    step: [120, 120],
    image_size: [640, 480],
    nodes: new Float32Array(),
  };
const line = (degree) => ({
  coefficients: Array.from({ length: degree + 1 }, () => 0),
  centre: 240,
  scale: 240,
});
const MODEL = {
  left: line(1),
  right: line(1),
  top: line(1),
  bottom: line(1),
  width_px: WIDTH,
  height_px: HEIGHT,
};
const down = (x) => [60, 150, 240, 330, 420].map((y) => [x, y]);
const across = (y) => [80, 200, 320, 440, 560].map((x) => [x, y]);
const POINTS = { left: down(80), right: down(560), top: across(60), bottom: across(420) };

const nodes = ({ nodes: all }) =>
  Array.from({ length: all.length / 2 }, (_, i) => [all[2 * i], all[2 * i + 1]]);
const near = (got, want) =>
  assert.ok(
    got.every(([x, y], i) => Math.hypot(x - want[i][0], y - want[i][1]) < 1e-3),
    JSON.stringify([got, want]),
  );

test("straight borders give a mesh of equal rectangles", () => {
  const want = Array.from({ length: 20 }, (_, i) => [
    80 + 120 * (i % 5),
    60 + 120 * Math.floor(i / 5),
  ]);
  near(nodes(bentMesh(MESH, MODEL, POINTS)), want);
});

test("a border that moves takes the mesh with it in proportion, and the far border stays", () => {
  const moved = nodes(bentMesh(MESH, MODEL, { ...POINTS, left: down(68) }));
  near(
    moved.slice(0, 5),
    [0, 1, 2, 3, 4].map((i) => [68 + 123 * i, 60]),
  );
});

test("a border keeps its degree: a bent one bends the mesh where it may", () => {
  const bent = POINTS.left.map(([x, y]) => [x + 8 * ((y - 240) / 180) ** 2, y]);
  const first = (degree) =>
    nodes(bentMesh(MESH, { ...MODEL, left: line(degree) }, { ...POINTS, left: bent })).filter(
      (_, i) => i % 5 === 0,
    );
  near(
    first(2),
    [60, 180, 300, 420].map((y) => [80 + 8 * ((y - 240) / 180) ** 2, y]),
  );
  const straight = first(1).map(([x]) => x);
  assert.ok(
    straight.every((x) => Math.abs(x - straight[0]) < 1e-3),
    String(straight),
  );
});

test("beyond its reach, and where borders have met, the mesh has no node", () => {
  const far = bentMesh({ ...MESH, first: [-240 - WIDTH, 0], step: [WIDTH, 120] }, MODEL, POINTS);
  assert.deepEqual(
    nodes(far)
      .slice(0, 5)
      .map(([x]) => Number.isNaN(x)),
    [true, false, false, false, true],
  );
  const met = bentMesh(MESH, MODEL, { ...POINTS, bottom: across(60.5) });
  assert.ok(met.nodes.every(Number.isNaN));
});

test("a border without enough points has no mesh", () => {
  assert.equal(bentMesh(MESH, MODEL, { ...POINTS, top: across(60).slice(0, 1) }), null);
  assert.equal(bentMesh(MESH, MODEL, { ...POINTS, right: [] }), null);
});
