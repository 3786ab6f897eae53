// @ts-check
/** The scenes of the ICP lab: what their answers say is what the engine does. */
import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { IcpLab, load, PointCloud } from '../../npm/index.js';
import { LAB_SCENES, labScene } from '../../npm/lab_scenes.js';

before(() => load());

/** @param {string} name */
function sceneOf(name) {
  const scene = labScene(name);
  assert.ok(scene, name);
  return scene;
}

/** The registration of a scene by one of its methods. @param {ReturnType<typeof sceneOf>} scene @param {object} options */
function run(scene, options) {
  const lab = new IcpLab(PointCloud.from_positions(scene.source), PointCloud.from_positions(scene.target), options);
  const trace = lab.trace(Float64Array.from(scene.start));
  const end = trace.poses.at(-1) ?? trace.initial;
  const shares = lab.iteration(Float64Array.from(end)).degeneracy?.shares ?? [];
  lab.free();
  /** @param {readonly number[]} T */
  const heading = (T) => Math.atan2(T[4] ?? 0, T[0] ?? 1);
  const at = (/** @type {number} */ i) => (end[i] ?? 0) - (scene.reference[i] ?? 0);
  const turn = heading(end) - heading(scene.reference);
  return {
    ...{ trace, end, shares, along: at(3), error: Math.hypot(at(3), at(7), at(11)) },
    turn: Math.abs(Math.atan2(Math.sin(turn), Math.cos(turn))),
  };
}

/** By all methods of a scene. @param {string} name */
const runs = (name) => {
  const scene = sceneOf(name);
  return scene.methods.map((options) => run(scene, options));
};

test('there are ten scenes, each with a question and an answer', () => {
  assert.equal(LAB_SCENES.length, 10);
  for (const name of LAB_SCENES) {
    const { question, answer, source, target } = sceneOf(name);
    assert.match(question, /\?$/);
    assert.match(answer, /\.$/);
    assert.ok(source.length > 300 && target.length > 300, name);
    assert.deepEqual(sceneOf(name).source, source, 'the same cloud every time');
  }
  assert.equal(labScene('toString'), null);
});

test('a corridor leaves the start along it, and tells so', () => {
  const [found] = runs('corridor');
  assert.match(found?.trace.end_reason ?? '', /converged|cycle/);
  assert.ok(Math.abs((found?.along ?? 0) - 0.5) < 0.1, `${found?.along} m`);
  assert.ok((found?.shares[0] ?? 1) < 0.01, `share ${found?.shares[0]}`);
  assert.ok((found?.shares[1] ?? 0) > 0.2);
});

test('a round room leaves the turn of the start', () => {
  const [found] = runs('circle');
  assert.ok((found?.turn ?? 0) > 0.2, `${found?.turn} rad`);
  assert.ok((found?.shares[0] ?? 1) < 0.01);
});

test('doors that repeat catch the source one door too far, at less cost than between doors', () => {
  const scene = sceneOf('repeated_doors');
  const wrong = run(scene, scene.methods[0] ?? {});
  assert.ok(Math.abs(wrong.along - 2) < 0.1, `${wrong.along} m`);
  const right = run({ ...scene, start: scene.reference }, scene.methods[0] ?? {});
  assert.ok(right.error < 0.05, `${right.error} m`);
  const between = run({ ...scene, start: [1, 0, 0, 1.2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }, scene.methods[0] ?? {});
  const [at_door = 1, off_doors = 0] = [wrong.trace.costs.at(-1), between.trace.costs[0]];
  assert.ok(at_door < off_doors / 3, `${at_door} against ${off_doors}`);
});

test('a turn of 70 degrees is too large, and a search finds it', () => {
  const scene = sceneOf('large_motion');
  const alone = run(scene, scene.methods[0] ?? {});
  assert.ok(alone.turn > 0.2 || alone.error > 0.3, `${alone.turn} rad, ${alone.error} m`);
  const options = { ...scene.methods[0], search_translation: 1, search_rotation: Math.PI / 2 };
  const lab = new IcpLab(PointCloud.from_positions(scene.source), PointCloud.from_positions(scene.target), options);
  const end = lab.trace().poses.at(-1) ?? [];
  lab.free();
  assert.ok(Math.hypot((end[3] ?? 0) - 0.6, (end[7] ?? 0) - 0.3) < 0.05, `${end[3]}, ${end[7]}`);
});

for (const { name, times, says } of [
  { name: 'partial_overlap', times: 3, says: 'trimming keeps out what has no partner' },
  { name: 'outliers', times: 3, says: 'a kernel takes the weight of people away' },
  { name: 'sparse_rings', times: 3, says: 'GICP sees walls where point to point sees rings' },
]) {
  test(`${name}: ${says}`, () => {
    const [worse, better] = runs(name);
    assert.ok(worse && better);
    const size = (/** @type {typeof worse} */ { error, turn }) => error + turn;
    assert.ok(size(worse) > times * size(better), `${size(worse)} against ${size(better)}`);
    assert.ok(better.error < 0.05, `${better.error} m`);
  });
}

test('without outliers trimming costs accuracy', () => {
  const [all, trimmed] = runs('trimming');
  assert.ok(all && trimmed);
  assert.ok(trimmed.error + trimmed.turn > all.error + all.turn, `${trimmed.error} m against ${all.error} m`);
});

test('point to point crawls', () => {
  const [point, line] = runs('point_to_point_crawl');
  assert.ok(point && line);
  assert.ok(
    point.trace.records.length > 3 * line.trace.records.length,
    `${point.trace.records.length} against ${line.trace.records.length}`,
  );
  assert.ok(line.error < 0.03 && point.error > 0.1, `${line.error} m, ${point.error} m`);
});

test('a plane determines three of six directions', () => {
  const [found] = runs('free_plane');
  assert.equal(found?.shares.filter((share) => share < 0.01).length, 3, `${found?.shares}`);
});
