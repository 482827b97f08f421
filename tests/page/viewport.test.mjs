// Where a picture lies on its stage: zoomed about a place, panned, fitted, revealed, and divided into panes.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { createViewport, placed } from "../../static/canvas/viewport.js";

const PICTURE = { width: 640, height: 480 };
let stage = createViewport();
const near = (got, want) =>
  assert.ok(
    got.every((v, i) => Math.abs(v - want[i]) < 1e-9),
    `${got} is not ${want}`,
  );

beforeEach(() => {
  stage = createViewport();
  stage.size.value = { width: 1000, height: 600 };
  stage.fit(PICTURE);
});

test("a fitted picture is whole, in the middle, and as large as there is room", () => {
  near(stage.toStage(319.5, 239.5), [500, 300]);
  near(stage.toStage(-0.5, -0.5), [500 - 384, 12]);
  assert.equal(stage.view.value.fitted, true);
  near(stage.toPicture(...stage.toStage(12.3, 45.6)), [12.3, 45.6]);
});

test("what lies under the pointer stays there when the picture is zoomed", () => {
  const before = stage.toPicture(700, 200);
  stage.zoomBy(2.5, 700, 200);
  near(stage.toPicture(700, 200), before);
  assert.equal(stage.view.value.fitted, false);
  stage.zoomBy(1e9, 700, 200);
  assert.equal(stage.view.value.k, 64);
  stage.zoomBy(1e-9, 700, 200);
  near([stage.view.value.k, ...stage.toPicture(700, 200)], [0.05, ...before]);
});

test("panning moves the picture by as much", () => {
  const [x, y] = stage.toStage(100, 100);
  stage.panBy(50, 30);
  near(stage.toStage(100, 100), [x + 50, y + 30]);
});

test("a point out of sight is brought to the edge, one in sight moves nothing", () => {
  stage.zoomBy(4, 0, 0);
  const { view } = stage;
  stage.reveal(10, 10);
  const before = view.value;
  stage.reveal(10, 10);
  assert.equal(view.value, before);
  stage.reveal(600, 400);
  near(stage.toStage(600, 400), [988, 588]);
});

test("a point is brought into the middle at the wished scale, never smaller than it was", () => {
  stage.centre(100, 50, 8);
  near([...stage.toStage(100, 50), stage.view.value.k], [500, 300, 8]);
  stage.centre(200, 50, 2);
  near([...stage.toStage(200, 50), stage.view.value.k], [500, 300, 8]);
});

test("in two panes one view holds: a place has its counterpart in the other one", () => {
  stage.divide({ columns: 2, rows: 1 }, PICTURE);
  near([stage.pane.value.width, stage.pane.value.height], [500, 600]);
  near(stage.toStage(319.5, 239.5), [250, 300]); // fitted again
  near(stage.toPicture(750, 300), stage.toPicture(250, 300));
  assert.deepEqual([stage.paneAt(499, 0), stage.paneAt(500, 0)], [0, 1]);
  stage.divide({ columns: 1, rows: 2 }, PICTURE);
  assert.deepEqual([stage.paneAt(999, 299), stage.paneAt(0, 300)], [0, 1]);
});

test("who has zoomed keeps the middle when the stage is divided", () => {
  stage.zoomBy(3, 500, 300);
  const middle = stage.toPicture(500, 300),
    { k } = stage.view.value;
  stage.divide({ columns: 2, rows: 1 }, PICTURE);
  near([...stage.toPicture(250, 300), stage.view.value.k], [...middle, k]);
});

test("from some zoom on pixels are shown as the squares they are", () => {
  assert.doesNotMatch(placed(1, 2, 3.9), /pixelated/);
  assert.match(placed(1, 2, 4), /pixelated/);
});
